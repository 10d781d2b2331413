/** The element `<ndf-viewer>`. */

export { COLORMAPS, type Colormap } from './viewer/colours.js';
export { NdfViewer, type ViewerEvents } from './viewer/element.js';
export { MODES, type View } from './viewer/looks.js';
export { PICTURE_MARK, type Up } from './viewer/stage.js';
