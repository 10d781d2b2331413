/** The bundled code of a Worker, as text. */
declare module 'worker:*' {
  const code: string;
  export default code;
}
