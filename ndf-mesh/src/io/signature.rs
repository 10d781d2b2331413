//! What a file is by its first bytes.
//!
//! Formats with a magic number are known by it and by nothing else. Every reader asks here first, so that none takes a
//! file of another format for its own: the title of a LAS file can hold what looks like the count of a binary STL.
//! Formats that are not read are named as well, and so is what stands in a file's place: a pointer, a web page.

use super::text::without_mark;

/// What the first bytes of a file say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Signature {
    /// PLY.
    Ply,
    /// LAS, or LAZ.
    Las,
    /// E57.
    E57,
    /// HDF5.
    Hdf5,
    /// An array of NumPy.
    Numpy,
    /// Niantic's SPZ, bare.
    Spz,
    /// Binary glTF.
    Glb,
    /// glTF in JSON.
    Gltf,
    /// A zip archive, which may hold arrays.
    Zip,
    /// Something packed by gzip.
    Gzip,
    /// What is not read, in words that complete "the file is …".
    Foreign(&'static str),
}

/// Beginnings, and what they say.
const BEGINNINGS: [(&[u8], Signature); 38] = {
    use Signature::Foreign;
    const PICTURE: Signature = Foreign("a picture");
    [
        (b"LASF", Signature::Las),
        (b"ASTM-E57", Signature::E57),
        (b"\x89HDF\r\n\x1a\n", Signature::Hdf5),
        (b"\x93NUMPY", Signature::Numpy),
        (b"NGSP", Signature::Spz),
        (b"glTF", Signature::Glb),
        (b"PK\x03\x04", Signature::Zip),
        (b"\x1f\x8b", Signature::Gzip),
        (b"PK\x05\x06", Foreign("an empty zip archive")),
        (
            b"version https://git-lfs",
            Foreign(
                "a pointer of Git LFS instead of the file itself; run `git lfs pull` where it was cloned, or download it again",
            ),
        ),
        (b"BZh", Foreign("packed by bzip2; unpack it first")),
        (b"\xfd7zXZ\0", Foreign("packed by xz; unpack it first")),
        (b"\x28\xb5\x2f\xfd", Foreign("packed by Zstandard; unpack it first")),
        (b"\x04\x22\x4d\x18", Foreign("packed by LZ4; unpack it first")),
        (b"7z\xbc\xaf\x27\x1c", Foreign("a 7z archive; unpack it first")),
        (b"Rar!\x1a\x07", Foreign("a RAR archive; unpack it first")),
        (b"\x89PNG\r\n", PICTURE),
        (b"\xff\xd8\xff", PICTURE),
        (b"GIF8", PICTURE),
        (b"RIFF", Foreign("a RIFF file, a picture or a recording")),
        (b"\x76\x2f\x31\x01", PICTURE),
        (b"%PDF-", Foreign("a PDF document")),
        (b"Kaydara FBX", Foreign("an FBX file, which is not read; export it as OBJ, PLY, STL or glTF")),
        (b"; FBX", Foreign("an FBX file, which is not read; export it as OBJ, PLY, STL or glTF")),
        (b"BLENDER", Foreign("a scene of Blender, which is not read; export it as OBJ, PLY, STL or glTF")),
        (b"PXR-USDC", Foreign("a USD file, which is not read; export it as OBJ, PLY, STL or glTF")),
        (b"#usda", Foreign("a USD file, which is not read; export it as OBJ, PLY, STL or glTF")),
        (b"DRACO", Foreign("packed by Draco, which is not read; unpack it as PLY or OBJ")),
        (b"OCTM", Foreign("an OpenCTM file, which is not read; convert it to PLY or OBJ")),
        (b"# vtk DataFile", Foreign("a VTK file, which is not read; convert it to PLY, OBJ or STL")),
        (b"ISO-10303-21", Foreign("a STEP file, which is not read; export it as STL or OBJ")),
        (
            b"3D Geometry File Format",
            Foreign("a Rhino model, which is not read; export it as OBJ, PLY, STL or glTF"),
        ),
        (b"MATLAB 5.0", Foreign("a MATLAB file, which is not read; save its arrays as .npz or HDF5")),
        (b"SQLite format 3", Foreign("an SQLite database")),
        (b"\x7fELF", Foreign("a program")),
        (
            b"<?xml",
            Foreign("XML, which is not read: a scene, or what a server says instead of sending the file"),
        ),
        (b"\xff\xfe", Foreign("text in UTF-16; save it as UTF-8")),
        (b"\xfe\xff", Foreign("text in UTF-16; save it as UTF-8")),
    ]
};

/// Where `tar` says what it is.
const TAR: usize = 257;

impl Signature {
    /// What the first bytes say; `None` for formats without a magic number.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if let Some((_, found)) = BEGINNINGS.iter().find(|(beginning, _)| bytes.starts_with(beginning)) {
            return Some(*found);
        }
        if bytes.get(TAR..).is_some_and(|rest| rest.starts_with(b"ustar")) {
            return Some(Self::Foreign("a tar archive; unpack it first"));
        }
        let text = without_mark(bytes).trim_ascii_start();
        let begins_in_any_case =
            |word: &str| text.get(..word.len()).is_some_and(|b| b.eq_ignore_ascii_case(word.as_bytes()));
        if without_mark(bytes)
            .strip_prefix(b"ply")
            .is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
        {
            Some(Self::Ply)
        } else if ["<!doctype html", "<html", "<head", "<body"].into_iter().any(begins_in_any_case) {
            Some(Self::Foreign("a web page instead of the file itself; download it again by its direct link"))
        } else if text.starts_with(b"<?xml") {
            Self::of(text)
        } else if text.starts_with(b"{") && !text.iter().take(16).any(|&b| b == 0) {
            // Safetensors begin with a length, whose first byte may be a brace; its last ones are zeros.
            Some(if is_gltf(text) { Self::Gltf } else { Self::Foreign("JSON, but no scene of glTF") })
        } else if bytes.len() > TAR && bytes.iter().all(|&b| b == 0) {
            Some(Self::Foreign("all zeros; it was not written or downloaded to its end"))
        } else {
            None
        }
    }

    /// A clause that says what it is, for readers that read something else.
    pub fn clause(self) -> &'static str {
        match self {
            Self::Ply => "it is a PLY file",
            Self::Las => "it is a LAS or LAZ file",
            Self::E57 => "it is an E57 file",
            Self::Hdf5 => "it is an HDF5 file",
            Self::Numpy => "it is an array of NumPy",
            Self::Spz => "it is an SPZ file of splats",
            Self::Glb => "it is binary glTF",
            Self::Gltf => "it is a scene of glTF",
            Self::Zip => "it is a zip archive",
            Self::Gzip => "it is packed by gzip; unpack it first",
            Self::Foreign(_) => "it is of a format that is not read",
        }
    }
}

/// Whether a text in JSON is a scene of glTF: one that has an `asset`, wherever it stands.
fn is_gltf(json: &[u8]) -> bool {
    const ASSET: &[u8] = b"\"asset\"";
    json.windows(ASSET.len()).any(|window| window == ASSET)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_the_place_of_a_file_is_named() {
        for (bytes, said) in [
            (&b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n"[..], "git lfs pull"),
            (b"<!DOCTYPE html>\n<html>", "web page"),
            (b"\xef\xbb\xbf \n<HTML lang=en>", "web page"),
            (b"\n<?xml version=\"1.0\"?><Error/>", "XML"),
            (b" {\"name\": \"package\"}", "no scene of glTF"),
            (b"BZh91AY", "bzip2"),
            (b"\xff\xfe0\0 \0", "UTF-16"),
            (&[0; 400], "zeros"),
        ] {
            match Signature::of(bytes) {
                Some(Signature::Foreign(what)) => assert!(what.contains(said), "{what}"),
                other => panic!("{other:?} instead of {said}"),
            }
        }
        assert_eq!(Signature::of(b"\xef\xbb\xbfply\r\n"), Some(Signature::Ply));
        assert_eq!(Signature::of(b" {\"asset\": {\"version\": \"2.0\"}}"), Some(Signature::Gltf));
        assert_eq!(Signature::of(b"plywood"), None);
        assert_eq!(Signature::of(b"1 2 3\n"), None);
        assert_eq!(Signature::of(b""), None);
    }
}
