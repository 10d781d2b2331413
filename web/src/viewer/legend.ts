import { gradient, readable, type ColourScale } from './colours.js';

/** What the colours mean: a name, a bar of the colours, and the values at its ends. */
export class Legend {
  readonly #element: HTMLElement;

  constructor(root: ShadowRoot) {
    this.#element = root.querySelector('.legend')!;
  }

  /** Shows a scale, or nothing. */
  show(what: string, scale: ColourScale | undefined): void {
    this.#element.hidden = scale === undefined;
    if (!scale) return;
    const part = (selector: string) => this.#element.querySelector<HTMLElement>(selector)!;
    const [low, high] = [readable(scale.low), readable(scale.high)];
    this.#element.setAttribute('aria-label', `${what}: colours from ${low} to ${high}`);
    part('.name').textContent = what;
    part('.bar').style.background = gradient(scale.map);
    part('.ends :first-child').textContent = low;
    part('.ends :last-child').textContent = high;
  }
}
