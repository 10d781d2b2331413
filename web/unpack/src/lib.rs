//! Unpacks the page: decodes LZMA, as the 7-Zip SDK specifies it (Pavlov 2015).
//!
//! Browsers have no decoder that packs WebAssembly as tightly. As WebAssembly this one is several times as fast from its first
//! byte on as JavaScript, which engines compile while it runs.

#![allow(unreachable_pub, reason = "what is public is exported to JavaScript")]

mod decoder;

use wasm_bindgen::prelude::wasm_bindgen;

/// The bytes of a file of LZMA (`.lzma`) whose header says how many there are; fewer where it is damaged.
#[wasm_bindgen]
pub fn unpack(data: &[u8]) -> Vec<u8> {
    decoder::decode(data).unwrap_or_default()
}
