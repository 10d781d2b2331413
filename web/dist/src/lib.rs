//! The page of `ndf view`: one HTML file that shows a model or a mesh, extracts, and computes geodesics and spectra. It needs
//! no server and no network.
//!
//! `cargo xtask web` builds the page from the folder above and the crates, compiled to WebAssembly; it is committed, so that
//! building the program needs neither. Here a model is put into it.
//!
//! ```
//! use ndf_viewer::Input;
//!
//! let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
//! let page = Input::new("tetrahedron.obj", tetrahedron.as_bytes()).to_html();
//! assert!(page.starts_with("<!DOCTYPE html>") && page.contains("tetrahedron.obj"));
//! ```

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde::Serialize;

/// The page without a model: it shows what is dropped on it.
pub const PAGE: &str = include_str!("../view.html");

/// What stands in the page where the model is put.
const MARK: &str = "<!--ndf:input-->";

/// What a page shows.
#[derive(Clone, Debug, Serialize)]
pub struct Input<'a> {
    /// Its name, which is the title.
    pub name: &'a str,
    /// A file: an `.ndf` model or a mesh (OBJ, PLY, STL, OFF, glTF).
    #[serde(skip)]
    pub bytes: &'a [u8],
    /// The stored scalar that is shown at the beginning.
    pub scalar: Option<&'a str>,
    /// Where distances are shown from at the beginning: from the vertex next to this place.
    pub source: Option<[f64; 3]>,
    /// The edge length of a model's mesh at the beginning, in the units of the file.
    pub edge_length: Option<f64>,
    /// The direction that points up: `x`, `y`, `z`, `-x`, `-y` or `-z`.
    pub up: Option<&'a str>,
}

/// An input as the page reads it.
#[derive(Serialize)]
struct Packed<'a> {
    #[serde(flatten)]
    input: &'a Input<'a>,
    /// Whether the data is deflated.
    packed: bool,
    /// Base64.
    data: String,
}

impl<'a> Input<'a> {
    /// A file that is shown plainly, at its default edge length.
    pub fn new(name: &'a str, bytes: &'a [u8]) -> Self {
        Self { name, bytes, scalar: None, source: None, edge_length: None, up: None }
    }

    /// The page with the file in it: about 4/3 of its bytes more, deflated where that is less. O(n).
    pub fn to_html(&self) -> String {
        let deflated = deflated(self.bytes);
        let packed = deflated.len() < self.bytes.len();
        let data = STANDARD.encode(if packed { &deflated } else { self.bytes });
        let input = Packed { input: self, packed, data };
        let json = serde_json::to_string(&input).expect("strings and numbers are JSON");
        // No name can end the element it stands in.
        PAGE.replacen(MARK, &json.replace('<', "\\u003c"), 1)
    }
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes all that is written")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the page would read.
    fn read(page: &str) -> serde_json::Value {
        let (_, rest) = page.split_once("id=\"input\">").unwrap();
        serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
    }

    #[test]
    fn what_is_put_in_is_there() {
        let bytes = [7; 1000];
        let input =
            Input { scalar: Some("heat"), source: Some([1.0, 2.0, 0.1]), ..Input::new("a.ndf", &bytes) };
        let read = read(&input.to_html());
        assert_eq!((&read["name"], &read["scalar"]), (&"a.ndf".into(), &"heat".into()));
        assert_eq!(read["source"], serde_json::json!([1.0, 2.0, 0.1]));
        let packed = STANDARD.decode(read["data"].as_str().unwrap()).unwrap();
        assert!(read["packed"].as_bool().unwrap() && packed.len() < 100);
        let mut decoder = flate2::write::DeflateDecoder::new(Vec::new());
        decoder.write_all(&packed).unwrap();
        assert_eq!(decoder.finish().unwrap(), bytes);
    }

    #[test]
    fn no_name_adds_markup() {
        let evil = "</script><script>alert(1)</script>";
        let page = Input { scalar: Some(evil), ..Input::new(evil, b"x") }.to_html();
        assert_eq!(page.matches("<script").count(), PAGE.matches("<script").count());
        assert_eq!(read(&page)["name"], evil);
    }

    #[test]
    fn the_page_is_small_and_asks_for_nothing() {
        assert!(PAGE.len() <= 1_000_000, "{}", PAGE.len());
        assert_eq!(PAGE.matches(MARK).count(), 1);
        for outside in [" src=", " href=", "@import", "url("] {
            assert!(!PAGE.contains(outside), "{outside}");
        }
    }
}
