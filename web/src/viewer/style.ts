/** The style of an element; `--ndf-background`, `-surface`, `-wire` and `-mark` change its colours. */
export const STYLE = `
:host { display: block; position: relative; min-height: 12rem; font: 13px/1.4 system-ui, sans-serif; }
canvas { display: block; position: absolute; inset: 0; width: 100%; height: 100%; outline: none; touch-action: none; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { outline: 2px solid #3b7ddd; outline-offset: -2px; }
.legend { position: absolute; left: 20px; bottom: calc(20px + var(--inset-bottom, 0px)); width: min(260px, calc(100% - 40px));
  color: #20262e; font-variant-numeric: tabular-nums; pointer-events: none; }
.legend .bar { height: 8px; border-radius: 4px; margin: 6px 0 4px; box-shadow: inset 0 0 0 1px rgb(0 0 0 / 0.12); }
.legend .ends { display: flex; justify-content: space-between; }
.message { position: absolute; inset: 0 var(--inset-right, 0px) var(--inset-bottom, 0px) 0; display: grid; place-items: center; padding: 10%; text-align: center; color: #20262e; font-size: 15px; }
[hidden] { display: none !important; }
@media (prefers-color-scheme: dark) { .legend, .message { color: #e4e8ee; } }
`;
