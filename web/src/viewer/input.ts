import type { Stage } from './stage.js';

/** Milliseconds and pixels within which a press is a click. */
const [CLICK_TIME, CLICK_WAY] = [600, 6];

/** Radians that a key turns by, and the share that is left of the distance after one that zooms. */
const [TURN, NEARER] = [0.12, 0.88];

/** Hears clicks, which are told with their place in the page, and keys; what drags is for the camera. */
export function listen(
  canvas: HTMLCanvasElement,
  stage: () => Stage | undefined,
  clicked: (x: number, y: number, hasShift: boolean) => void,
): void {
  let pressed: { x: number; y: number; time: number } | undefined;
  let pointers = 0;
  canvas.addEventListener('pointerdown', ({ clientX: x, clientY: y, timeStamp: time, button }) => {
    pointers++;
    pressed = pointers === 1 && button === 0 ? { x, y, time } : undefined;
  });
  canvas.addEventListener('pointercancel', () => {
    pointers = 0;
    pressed = undefined;
  });
  canvas.addEventListener('pointerup', ({ clientX: x, clientY: y, timeStamp: time, shiftKey }) => {
    pointers = Math.max(0, pointers - 1);
    const start = pressed;
    pressed = undefined;
    if (!start || time - start.time > CLICK_TIME || Math.hypot(x - start.x, y - start.y) > CLICK_WAY) return;
    clicked(x, y, shiftKey);
  });
  canvas.addEventListener('keydown', (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const actions: Record<string, () => void> = {
      ArrowLeft: () => stage()?.turn(-TURN, 0),
      ArrowRight: () => stage()?.turn(TURN, 0),
      ArrowUp: () => stage()?.turn(0, TURN),
      ArrowDown: () => stage()?.turn(0, -TURN),
      '+': () => stage()?.zoom(NEARER),
      '=': () => stage()?.zoom(NEARER),
      '-': () => stage()?.zoom(1 / NEARER),
      '0': () => stage()?.frame(),
      Enter: () => clicked(left + width / 2, top + height / 2, event.shiftKey),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}
