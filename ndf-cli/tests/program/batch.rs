//! Many inputs: a row for each, however it ends, and the same rows however often the batch is broken.

use serde_json::Value;

use super::{Folder, Run, json, ndf};

/// A folder with two meshes that can be learned and a file that cannot.
fn shapes(test: &str) -> Folder {
    let folder = Folder::new(test);
    std::fs::create_dir_all(folder.0.join("in/deep")).unwrap();
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "in/torus.ply"]);
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "in/deep/sphere.obj"]);
    folder.write("in/bad.obj", "v 0 0 0\nv 1 0 0\n");
    folder
}

const QUICK: [&str; 6] = ["--field", "levels", "--size", "1000", "--base-faces", "100"];

fn batch(folder: &Folder, command: &str, more: &[&str]) -> Run {
    ndf(&folder.0, &[&["batch", command, "in", "-o", "run", "--quiet", "--json"], more].concat())
}

/// The rows of a file, all as the schema says.
fn rows(folder: &Folder, file: &str, command: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(folder.0.join(file)).unwrap();
    let rows: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    rows.iter().for_each(|row| json::check_row(command, row));
    rows
}

/// Rows without what differs from run to run, and without what only those know who make the base mesh.
fn lasting(mut rows: Vec<Value>) -> Vec<Value> {
    fn remove_times(value: &mut Value) {
        if let Value::Object(object) = value {
            let differs = ["peak_bytes", "base", "area_left_out"];
            object.retain(|key, _| !key.starts_with("seconds") && !differs.contains(&key.as_str()));
            object.values_mut().for_each(remove_times);
        }
    }
    rows.iter_mut().for_each(remove_times);
    rows
}

fn of<'a>(rows: &'a [Value], key: &str) -> Vec<&'a str> {
    rows.iter().map(|row| row[key].as_str().unwrap_or("")).collect()
}

#[test]
fn every_input_has_a_row() {
    let folder = shapes("batch-rows");
    let done = batch(&folder, "fit", &[&["--"], &QUICK[..]].concat()).json();
    assert_eq!(
        (&done["items"], &done["items_made"], &done["counts"]["refused"]),
        (&3.into(), &3.into(), &1.into())
    );
    let found = rows(&folder, "run/rows-1.jsonl", "fit");
    assert_eq!(of(&found, "id"), ["bad.obj", "deep/sphere.obj", "torus.ply"]);
    assert_eq!(of(&found, "status"), ["refused", "ok", "ok"]);
    assert_eq!(of(&found, "output"), ["", "files/deep/sphere.obj.ndf", "files/torus.ply.ndf"]);
    assert!(found[0]["message"].as_str().unwrap().contains("in/bad.obj"), "{}", found[0]);
    assert_eq!(found[0]["exit_code"], 1);
    assert_eq!(found[1]["input_sha256"].as_str().unwrap().len(), 64);
    let bytes = std::fs::read(folder.0.join("run/files/torus.ply.ndf")).unwrap();
    assert_eq!(found[2]["result"]["model_bytes"].as_u64(), Some(bytes.len() as u64));
    // The same as one by one.
    let alone = [&["fit", "in/torus.ply", "-o", "alone.ndf"], &QUICK[..]].concat();
    assert_eq!(ndf(&folder.0, &alone).code, 0);
    assert!(std::fs::read(folder.0.join("alone.ndf")).unwrap() == bytes);

    let again = batch(&folder, "fit", &[&["--"], &QUICK[..]].concat());
    assert!(again.sentence().contains("--resume"), "{}", again.stderr);
    let again = batch(&folder, "fit", &[&["--resume", "--"], &QUICK[..]].concat()).json();
    assert_eq!((&again["items_made"], &again["counts"]), (&0.into(), &done["counts"]));
    assert_eq!(rows(&folder, "run/rows-1.jsonl", "fit"), found);
    let other = batch(&folder, "fit", &["--resume", "--", "--size", "2000"]);
    assert!(other.sentence().contains("flags: --field levels"), "{}", other.stderr);
    assert!(batch(&folder, "info", &["--resume"]).sentence().contains("command: fit, now info"));
}

#[test]
fn options_are_checked_before_anything_starts() {
    let folder = shapes("batch-options");
    for (more, said) in [
        (&["--", "--modes", "3"][..], "--modes"),
        (&["--", "--base-faces", "x"], "base-faces"),
        (&["--", "-o", "x.ndf"], "--extension"),
        (&["--", "--threads", "2"], "before `--`"),
        (&["--seed", "2", "--", "--seed", "1"], "--seed"),
        (&["--retry"], "--resume"),
        (&["--shard", "3/2"], "no part 3 of 2"),
        (&["--memory", "lots"], "number of bytes"),
    ] {
        let run = batch(&folder, "fit", more);
        assert_eq!(run.code, 2, "{more:?}: {}", run.stderr);
        assert!(run.stderr.contains(said), "{more:?}: {}", run.stderr);
    }
    let run = ndf(&folder.0, &["batch", "info", "in", "-o", "run", "--extension", "ply"]);
    assert!(run.code == 2 && run.stderr.contains("writes no file"), "{}", run.stderr);
    let missing = ndf(&folder.0, &["batch", "info", "in", "none/*.ply", "-o", "run"]);
    assert!(missing.sentence().contains("none/*.ply"));
    assert!(!folder.0.join("run").exists());
    assert!(ndf(&folder.0, &["batch", "merge", "in"]).sentence().contains("no plan.json"));
}

/// Parts that are done apart and put together are the whole; a list names its items.
#[test]
fn parts_make_the_whole() {
    let folder = shapes("batch-parts");
    let list =
        "# id, tab, path\nround\tin/deep/sphere.obj\nsub/ring\tin/torus.ply\nin/bad.obj\ngone\tin/none.ply\n";
    folder.write("list.txt", list);
    let part = |output: &str, shard: &[&str]| {
        ndf(&folder.0, &[&["batch", "info", "@list.txt", "-o", output, "--json", "--quiet"], shard].concat())
    };
    assert_eq!(part("whole", &[]).json()["items"], 4);
    assert_eq!(part("parts", &["--shard", "2/3"]).json()["items"], 1);
    let merge = |more: &[&str]| ndf(&folder.0, &[&["batch", "merge", "parts", "--json"], more].concat());
    let missing = merge(&[]);
    assert!(missing.sentence().contains("3 rows are missing: 2 of 2 of part 1/3, 1 of 1 of part 3/3"));
    assert_eq!(merge(&["--partial"]).json()["rows"], 1);
    assert!(part("parts", &["--shard", "1/2"]).sentence().contains("shards: 3, now 2"));
    // A task of a Slurm array.
    let slurm = std::process::Command::new(env!("CARGO_BIN_EXE_ndf"))
        .current_dir(&folder.0)
        .args(["batch", "info", "@list.txt", "-o", "parts", "--quiet"])
        .envs(
            [("ID", "4"), ("MIN", "0"), ("STEP", "2"), ("COUNT", "3")]
                .map(|(name, value)| (format!("SLURM_ARRAY_TASK_{name}"), value)),
        )
        .output()
        .unwrap();
    assert!(slurm.status.success() && String::from_utf8(slurm.stdout).unwrap().contains("rows-3.jsonl"));
    part("parts", &["--shard", "1/3"]).json();
    assert_eq!(merge(&[]).json()["missing"], 0);
    let all = rows(&folder, "parts/rows.jsonl", "info");
    assert_eq!(of(&all, "id"), ["round", "sub/ring", "bad.obj", "gone"]);
    assert_eq!(of(&all, "status"), ["ok", "ok", "ok", "refused"]);
    assert_eq!(lasting(all), lasting(rows(&folder, "whole/rows-1.jsonl", "info")));
}

#[test]
fn a_report_shows_what_became_of_all() {
    let folder = shapes("batch-report");
    batch(&folder, "fit", &[&["--"], &QUICK[..]].concat()).json();
    let report = ndf(&folder.0, &["batch", "report", "run", "--json", "--quiet"]).json();
    assert_eq!((&report["items"], &report["missing"]), (&3.into(), &0.into()));
    let csv = std::fs::read_to_string(folder.0.join("run/results.csv")).unwrap();
    assert_eq!(csv.lines().count(), 4);
    assert!(csv.lines().next().unwrap().contains(",result.projection_rms"));
    let page = std::fs::read_to_string(folder.0.join("run/index.html")).unwrap();
    for said in
        ["ndf fit of 3 inputs", "Why inputs failed", "refused: ", "deep/sphere.obj", "The worst by error"]
    {
        assert!(page.contains(said), "the page lacks {said}");
    }
    // Input and result of both that were learned.
    assert_eq!(page.matches("data:image/png").count(), 4);
    assert!(page.matches("<svg").count() >= 3 && !page.contains("://") && !page.contains("<script"));
    // From another folder, too.
    ndf(&folder.0.join("in"), &["batch", "report", "../run", "--json", "--quiet"]).json();
    let again = std::fs::read_to_string(folder.0.join("run/index.html")).unwrap();
    assert_eq!(again.matches("data:image/png").count(), 4);
    let plain = ndf(&folder.0, &["batch", "report", "run", "--no-pictures"]);
    assert!(plain.stdout.contains("index.html: 2 ok, 1 refused"), "{}", plain.stdout);
    assert!(!std::fs::read_to_string(folder.0.join("run/index.html")).unwrap().contains("data:image"));
}

#[cfg(target_os = "linux")]
mod on_linux {
    use std::fs;
    use std::io::Write as _;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::Duration;

    use super::*;

    fn start(folder: &Folder, arguments: &[&str]) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ndf"));
        command
            .current_dir(&folder.0)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn kill(signal: &str, process: u32) {
        assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
    }

    /// Waits for something that will come.
    fn until<T>(mut look: impl FnMut() -> Option<T>) -> T {
        loop {
            if let Some(found) = look() {
                return found;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The child of a process whose command line has this word.
    fn child(of: u32, word: &str) -> Option<u32> {
        let numbers =
            fs::read_dir("/proc").unwrap().filter_map(|e| e.unwrap().file_name().to_str()?.parse().ok());
        numbers.into_iter().find(|process: &u32| {
            let read = |name: &str| fs::read_to_string(format!("/proc/{process}/{name}")).unwrap_or_default();
            let parent = read("status").lines().find_map(|l| l.strip_prefix("PPid:")?.trim().parse().ok());
            parent == Some(of) && read("cmdline").split('\0').any(|part| part.ends_with(word))
        })
    }

    fn is_running(process: u32) -> bool {
        let state = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        state.lines().find_map(|line| line.strip_prefix("State:")).is_some_and(|state| !state.contains('Z'))
    }

    fn fifo(folder: &Folder, name: &str) {
        assert!(Command::new("mkfifo").arg(folder.0.join(name)).status().unwrap().success());
    }

    /// Pipes make inputs that never end: one that nothing comes of, one that too much comes of, one whose process is killed.
    #[test]
    fn limits_and_crashes_are_rows_too() {
        let folder = Folder::new("batch-limits");
        fs::create_dir(folder.0.join("in")).unwrap();
        ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "in/good.ply"]);
        ["in/crash.ply", "in/greedy.ply", "in/slow.ply"].iter().for_each(|name| fifo(&folder, name));
        let limits = ["--jobs", "4", "--timeout", "20", "--memory", "120M", "--", "--grid", "16"];
        let arguments = [&["batch", "mesh", "in", "-o", "run", "--quiet", "--json"], &limits[..]].concat();
        let run = start(&folder, &arguments);
        let greedy = folder.0.join("in/greedy.ply");
        let feeder = std::thread::spawn(move || {
            let mut pipe = fs::OpenOptions::new().write(true).open(greedy).unwrap();
            let _ = pipe.write_all(b"ply\n");
            while pipe.write_all(&[b' '; 1 << 16]).is_ok() {}
        });
        let crashing = until(|| child(run.id(), "crash.ply"));
        kill("-ABRT", crashing);
        feeder.join().unwrap();
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found = rows(&folder, "run/rows-1.jsonl", "mesh");
        assert_eq!(of(&found, "id"), ["crash.ply", "good.ply", "greedy.ply", "slow.ply"]);
        assert_eq!(of(&found, "status"), ["crash", "ok", "memory", "timeout"]);
        assert!(found[0]["message"].as_str().unwrap().contains("SIGABRT"));
        assert!(found[2]["message"].as_str().unwrap().contains("125,829,120 bytes"));
        assert!(found[3]["message"].as_str().unwrap().contains("20 s"));
        assert!(found.iter().all(|row| row["peak_bytes"].as_u64().unwrap() > 0));
        assert_eq!(names(&folder.0.join("run/files")), ["good.ply.ply"]);

        // What ended by a limit or a crash can be done again.
        let good = fs::read(folder.0.join("in/good.ply")).unwrap();
        for name in ["in/crash.ply", "in/greedy.ply", "in/slow.ply"] {
            fs::remove_file(folder.0.join(name)).unwrap();
            folder.write(name, &good);
        }
        let retried = batch(&folder, "mesh", &["--resume", "--retry", "--", "--grid", "16"]).json();
        assert_eq!((&retried["items_made"], &retried["counts"]["ok"]), (&3.into(), &4.into()));
        let found = rows(&folder, "run/rows-1.jsonl", "mesh");
        assert_eq!(of(&found, "id"), ["crash.ply", "good.ply", "greedy.ply", "slow.ply"]);
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_str().unwrap().to_owned())
            .collect();
        names.sort();
        names
    }

    const SLOW: [&str; 7] = ["--", "--size", "1000", "--base-faces", "100", "--checkpoint-every", "0"];

    /// A batch that learns, until the item of this name has a checkpoint.
    fn learning(folder: &Folder, name: &str) -> (Child, u32) {
        let arguments = [&["batch", "fit", "in", "-o", "run", "--jobs", "1", "--quiet"], &SLOW[..]].concat();
        let run = start(folder, &arguments);
        let checkpoint = folder.0.join(format!("run/checkpoints/{name}.checkpoint"));
        until(|| checkpoint.exists().then_some(()));
        let process = until(|| child(run.id(), name));
        (run, process)
    }

    #[test]
    fn a_batch_that_is_broken_ends_as_one_that_is_not() {
        let unbroken = shapes("batch-unbroken");
        batch(&unbroken, "fit", &[&["--jobs", "1"], &SLOW[..]].concat()).json();
        let expected = lasting(rows(&unbroken, "run/rows-1.jsonl", "fit"));
        let same = |folder: &Folder| {
            let done = batch(folder, "fit", &[&["--jobs", "1", "--resume"], &SLOW[..]].concat()).json();
            assert_eq!(done["counts"]["ok"], 2);
            assert_eq!(lasting(rows(folder, "run/rows-1.jsonl", "fit")), expected);
            for name in ["torus.ply.ndf", "deep/sphere.obj.ndf"] {
                let read = |folder: &Folder| fs::read(folder.0.join("run/files").join(name)).unwrap();
                assert!(read(folder) == read(&unbroken), "{name}");
            }
            assert_eq!(names(&folder.0.join("run/files")), ["deep", "torus.ply.ndf"]);
            assert_eq!(names(&folder.0.join("run/checkpoints")), ["deep"]);
            assert_eq!(
                names(&folder.0.join("run")),
                ["checkpoints", "files", "items.txt", "plan.json", "rows-1.jsonl"]
            );
        };

        // Nothing can be done about this signal, but the process that learns ends with the batch. What it was writing, and a
        // line that was being written, are torn.
        let folder = shapes("batch-killed");
        let (mut run, process) = learning(&folder, "torus.ply");
        run.kill().unwrap();
        run.wait().unwrap();
        until(|| (!is_running(process)).then_some(()));
        folder.write("run/files/.torus.ply.ndf.abcdef.tmp", "half");
        let mut file = fs::OpenOptions::new().append(true).open(folder.0.join("run/rows-1.jsonl")).unwrap();
        file.write_all(b"{\"id\":\"torus.ply\",\"inp").unwrap();
        same(&folder);

        // A request to end is passed on, and what was learned is kept.
        let folder = shapes("batch-ended");
        let (run, process) = learning(&folder, "deep/sphere.obj");
        kill("-TERM", run.id());
        let output = run.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("interrupted with 2 of 3 items to go") && said.contains("--resume"), "{said}");
        assert!(!is_running(process));
        assert_eq!(of(&rows(&folder, "run/rows-1.jsonl", "fit"), "id"), ["bad.obj"]);
        assert!(folder.0.join("run/checkpoints/deep/sphere.obj.checkpoint").exists());
        // A checkpoint that is of no use is not used.
        folder.write("run/checkpoints/deep/sphere.obj.checkpoint", "nonsense");
        same(&folder);

        // Whoever interrupts twice does not want to wait.
        let folder = shapes("batch-insisted");
        let (run, process) = learning(&folder, "torus.ply");
        kill("-INT", run.id());
        kill("-TERM", run.id());
        let output = run.wait_with_output().unwrap();
        assert!(!output.status.success() && !is_running(process));
        same(&folder);
    }

    /// One process that is killed is a crash, and done again it ends as it would have.
    #[test]
    fn a_process_that_is_killed_is_a_crash() {
        let folder = shapes("batch-child");
        let (run, process) = learning(&folder, "torus.ply");
        kill("-KILL", process);
        assert!(run.wait_with_output().unwrap().status.success());
        let found = rows(&folder, "run/rows-1.jsonl", "fit");
        assert_eq!(of(&found, "status"), ["refused", "ok", "crash"]);
        assert_eq!((&found[2]["exit_code"], &found[2]["output"]), (&Value::Null, &Value::Null));
        assert!(found[2]["message"].as_str().unwrap().contains("SIGKILL"));
        assert_eq!(names(&folder.0.join("run/files")), ["deep"]);
        let retried = batch(&folder, "fit", &[&["--resume", "--retry"], &SLOW[..]].concat()).json();
        assert_eq!(retried["counts"]["ok"], 2);
    }

    /// Two processes do not add to the same rows.
    #[test]
    fn a_part_is_done_by_one_process() {
        let folder = shapes("batch-locked");
        let (mut run, _) = learning(&folder, "torus.ply");
        let second = batch(&folder, "fit", &[&["--resume"], &SLOW[..]].concat());
        assert!(second.sentence().contains("another process is at work"), "{}", second.stderr);
        run.kill().unwrap();
        run.wait().unwrap();
    }
}
