//! Sparse symmetric matrices as files: SciPy's `.npz` and Matrix Market.
//!
//! Written here, of what NumPy and NIST describe, since the crates that do it bring a second zip library and a parser generator
//! for some forty lines.

use std::io::{self, Write};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A symmetric matrix in compressed rows: row `i` has the entries `offsets[i]..offsets[i + 1]`, whose columns ascend.
#[derive(Clone, Copy, Debug)]
pub struct SymmetricMatrix<'a> {
    /// Where the entries of every row begin, and where the last ends.
    pub offsets: &'a [usize],
    /// The column of every entry.
    pub columns: &'a [usize],
    /// The value of every entry.
    pub values: &'a [f64],
}

impl SymmetricMatrix<'_> {
    /// Number of rows.
    fn size(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Writes what `scipy.sparse.load_npz` reads: a matrix in compressed rows. O(entries).
    ///
    /// # Errors
    /// What the system says.
    pub fn write_npz(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut zip = ZipWriter::new_stream(out);
        let options = SimpleFileOptions::default().large_file(self.values.len() > 1 << 28);
        let mut put =
            |name: &str, kind: &str, shape: &str, write: &dyn Fn(&mut dyn Write) -> io::Result<()>| {
                zip.start_file(format!("{name}.npy"), options)?;
                zip.write_all(&header(kind, shape))?;
                write(&mut zip)
            };
        let (size, entries) = (self.size() as i64, format!("({},)", self.values.len()));
        put("indices", "<i8", &entries, &|out| integers(out, self.columns))?;
        put("indptr", "<i8", &format!("({},)", self.offsets.len()), &|out| integers(out, self.offsets))?;
        put("format", "|S3", "()", &|out| out.write_all(b"csr"))?;
        put("shape", "<i8", "(2,)", &|out| {
            [size; 2].iter().try_for_each(|n| out.write_all(&n.to_le_bytes()))
        })?;
        put("data", "<f8", &entries, &|out| {
            self.values.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))
        })?;
        zip.finish()?;
        Ok(())
    }

    /// Writes Matrix Market's coordinates of the lower triangle, with all digits (Boisvert, Pozo and Remington 1996). O(entries).
    ///
    /// # Errors
    /// What the system says.
    pub fn write_matrix_market(&self, out: &mut dyn Write) -> io::Result<()> {
        let rows = |row: usize| (self.offsets[row]..self.offsets[row + 1]).map(move |slot| (row, slot));
        let lower = || (0..self.size()).flat_map(rows).filter(|&(row, slot)| self.columns[slot] <= row);
        writeln!(out, "%%MatrixMarket matrix coordinate real symmetric")?;
        writeln!(out, "{} {} {}", self.size(), self.size(), lower().count())?;
        for (row, slot) in lower() {
            writeln!(out, "{} {} {:e}", row + 1, self.columns[slot] + 1, self.values[slot])?;
        }
        Ok(())
    }
}

fn integers(out: &mut dyn Write, numbers: &[usize]) -> io::Result<()> {
    numbers.iter().try_for_each(|&n| out.write_all(&(n as i64).to_le_bytes()))
}

/// The header of a `.npy` file, padded so that data begin at a multiple of 64 bytes.
fn header(kind: &str, shape: &str) -> Vec<u8> {
    let fields = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + fields.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{fields:<width$}\n", width = length - 1).bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// [[2, −1, 0], [−1, 2.5, 0], [0, 0, 1e−20]].
    const MATRIX: SymmetricMatrix<'_> = SymmetricMatrix {
        offsets: &[0, 2, 4, 5],
        columns: &[0, 1, 0, 1, 2],
        values: &[2.0, -1.0, -1.0, 2.5, 1e-20],
    };

    #[test]
    fn lower_triangles_are_written_with_all_digits() {
        let mut text = Vec::new();
        MATRIX.write_matrix_market(&mut text).unwrap();
        let expected = "%%MatrixMarket matrix coordinate real symmetric\n3 3 4\n1 1 2e0\n2 1 -1e0\n2 2 2.5e0\n3 3 1e-20\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn arrays_are_those_that_scipy_looks_for() {
        let mut bytes = Vec::new();
        MATRIX.write_npz(&mut bytes).unwrap();
        let mut zip = zip::ZipArchive::new(Cursor::new(bytes.as_slice())).unwrap();
        let names: Vec<String> =
            (0..zip.len()).map(|i| zip.by_index(i).unwrap().name().unwrap().into_owned()).collect();
        assert_eq!(names, ["indices.npy", "indptr.npy", "format.npy", "shape.npy", "data.npy"]);
        for i in 0..zip.len() {
            let mut entry = Vec::new();
            io::copy(&mut zip.by_index(i).unwrap(), &mut entry).unwrap();
            let length = usize::from(u16::from_le_bytes([entry[8], entry[9]]));
            assert_eq!((10 + length) % 64, 0);
            assert_eq!(entry[10 + length - 1], b'\n');
        }
    }
}
