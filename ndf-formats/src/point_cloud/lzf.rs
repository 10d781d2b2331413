//! LZF, the compression of PCD files (Marc Lehmann 2000).

use super::FileDefect;

/// Longest copy one instruction of three bytes can make.
const LONGEST_COPY: usize = 264;

/// Expands to exactly `size` bytes.
pub(super) fn expand(input: &[u8], size: usize) -> Result<Vec<u8>, FileDefect> {
    if size / LONGEST_COPY > input.len() {
        let text = format!("{} compressed bytes cannot expand to {size} bytes", input.len());
        return Err(FileDefect::truncated(text));
    }
    let cut = || FileDefect::truncated("the compressed data is cut off");
    let mut output = Vec::with_capacity(size);
    let mut rest = input;
    let mut byte = || {
        let (&first, others) = rest.split_first()?;
        rest = others;
        Some(first)
    };
    while output.len() < size {
        let control = usize::from(byte().ok_or_else(cut)?);
        if control < 32 {
            for _ in 0..=control {
                output.push(byte().ok_or_else(cut)?);
            }
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(byte().ok_or_else(cut)?);
            }
            let back = ((control & 31) << 8) + usize::from(byte().ok_or_else(cut)?) + 1;
            let before =
                || FileDefect::undecodable("the compressed data refers to bytes before its beginning");
            let start = output.len().checked_sub(back).ok_or_else(before)?;
            // The copy may overlap what it makes.
            for i in start..start + length + 2 {
                output.push(output[i]);
            }
        }
    }
    if output.len() > size {
        return Err(FileDefect::undecodable(format!(
            "the compressed data expands to more than {size} bytes"
        )));
    }
    Ok(output)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_overlapping_copies_expand() {
        assert_eq!(expand(&[2, b'a', b'b', b'c'], 3).unwrap(), b"abc");
        // "ab", then 3 + 2 bytes from 2 back.
        assert_eq!(expand(&[1, b'a', b'b', 3 << 5, 1], 7).unwrap(), b"abababa");
        assert_eq!(expand(&[0, b'x', 7 << 5, 255, 0], 265).unwrap(), vec![b'x'; 265]);
        assert_eq!(expand(&[], 0).unwrap(), b"");
    }

    #[test]
    fn defects_are_told() {
        for (input, size) in [
            (&[2, b'a'][..], 3),
            (&[3 << 5, 1], 5),
            (&[2, b'a', b'b', b'c'], 2),
            (&[0, b'x'], usize::MAX),
            (&[], 1),
        ] {
            assert!(expand(input, size).is_err(), "{input:?}");
        }
    }
}
