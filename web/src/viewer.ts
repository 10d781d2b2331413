/** The element `<ndf-viewer>`. */

export { COLORMAPS, type Colormap } from './viewer/colours.js';
export { MODES, NdfViewer, type View, type ViewerEvents } from './viewer/element.js';
export type { Up } from './viewer/stage.js';
