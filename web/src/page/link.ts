/** Models in the fragment of a link: `#m=` and their bytes as base64url. */

/** The bytes as base64url. */
export function toBase64Url(bytes: Uint8Array): string {
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}

/** The bytes of base64url. */
export function fromBase64Url(text: string): Uint8Array {
  try {
    return Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (c) => c.charCodeAt(0));
  } catch {
    throw new Error('the model in the link is damaged');
  }
}

/** The model in a fragment, if there is one. */
export function modelIn(fragment: string): { bytes: Uint8Array; name: string } | undefined {
  const parameters = new URLSearchParams(fragment.replace(/^#/, ''));
  const model = parameters.get('m');
  return model === null ? undefined : { bytes: fromBase64Url(model), name: parameters.get('n') ?? 'model.ndf' };
}

/** Whether this page has an address to link to: in a frame that holds its text it has none. */
export const hasAddress = location.protocol !== 'about:';

/** This page with a model in its fragment. */
export function linkTo(bytes: Uint8Array, name: string): string {
  const parameters = new URLSearchParams({ m: toBase64Url(bytes), n: name });
  return `${location.href.split('#', 1)[0]}#${parameters}`;
}
