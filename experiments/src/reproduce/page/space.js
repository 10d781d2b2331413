// The plots of file size, client seconds and error. Data: for each task, runs with their bytes at true size and in the plane.
(function () {
  // Ours are warm colours.
  const ours = ['#d62728', '#ff7f0e', '#c2185b', '#8c1d18', '#f4a100', '#7b2d8b', '#e5735c'];
  const others = ['#1f77b4', '#2ca02c', '#17becf', '#7f7f7f', '#3b3b98', '#8c9a22', '#006266', '#5d4037', '#8fb8de', '#1b5e20', '#000000'];
  const isOurs = (method) => method.startsWith('ours');
  const methods = [...new Set(RUNS.flatMap((task) => task.runs.map((run) => run.method)))];
  const colour = (method) => {
    const alike = methods.filter((other) => isOurs(other) === isOurs(method));
    const palette = isOurs(method) ? ours : others;
    return palette[alike.indexOf(method) % palette.length];
  };
  const percent = (share) => (100 * share).toPrecision(3) + ' %';
  const axis = (title, suffix) => ({ title: { text: title }, type: 'log', ticksuffix: suffix, exponentformat: 'none', dtick: 'D2', showspikes: false });

  function draw(task, element, shape, isPlane) {
    const chosen = task.runs.filter((run) => shape === '' || run.shape === shape);
    const traces = methods.map((method) => {
      const runs = chosen.filter((run) => run.method === method);
      const best = (run) => (isPlane ? run.best_in_plane : run.best);
      return {
        type: 'scatter3d', mode: 'markers', name: method,
        x: runs.map((run) => (isPlane ? run.plane : run.bytes) / 1000),
        y: runs.map((run) => run.seconds),
        z: runs.map((run) => 100 * run.error),
        marker: {
          size: runs.map((run) => (best(run) ? 7 : 4)),
          color: colour(method),
          symbol: isOurs(method) ? 'diamond' : 'circle',
          opacity: 0.85,
        },
        text: runs.map((run) => `${run.shape}: ${method}, ${run.setting}<br>${(run.bytes / 1000).toFixed(1)} kB, ` +
          `${run.seconds.toPrecision(3)} s, ${percent(run.error)}${best(run) ? '<br>on the frontier' : ''}`),
        hoverinfo: 'text',
      };
    }).filter((trace) => trace.x.length > 0);
    const scene = {
      xaxis: axis('file, kB', ''), yaxis: axis('client seconds', ' s'), zaxis: axis('error, %', ''),
      camera: { eye: { x: 1.6, y: 1.6, z: 0.9 } },
    };
    Plotly.react(element, traces, { scene, margin: { l: 0, r: 0, t: 0, b: 0 }, legend: { x: 0, y: 1 }, uirevision: 'kept' },
      { responsive: true, displaylogo: false });
  }

  RUNS.forEach((task) => {
    const element = document.getElementById('space-' + task.name);
    const shape = document.getElementById('shape-' + task.name);
    const plane = document.getElementById('plane-' + task.name);
    const again = () => draw(task, element, shape.value, plane.checked);
    shape.addEventListener('change', again);
    plane.addEventListener('change', again);
    again();
  });
})();
