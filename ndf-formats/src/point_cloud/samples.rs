//! Small files of every format, made by code: for tests, and as seeds of fuzzers.

use std::io::Cursor;

use e57::{E57Writer, Record, RecordValue};
use las::{Builder, Point, Writer};
use ndf_core::DVec3;

/// A PCD file; `data` is `ascii`, `binary` or `binary_compressed`. All points have the same normal, if any.
pub fn pcd(points: &[DVec3], normal: Option<DVec3>, data: &str) -> Vec<u8> {
    let columns = if normal.is_some() { 6 } else { 3 };
    let names = ["x", "y", "z", "normal_x", "normal_y", "normal_z"];
    let repeated = |word: &str| vec![word; columns].join(" ");
    let n = points.len();
    let mut bytes = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA {data}\n",
        names[..columns].join(" "),
        repeated("8"),
        repeated("F"),
        repeated("1"),
    )
    .into_bytes();
    let value = |row: usize, column: usize| {
        let vector = if column < 3 { points[row] } else { normal.unwrap_or_default() };
        vector[column % 3]
    };
    let doubles = |places: &mut dyn Iterator<Item = (usize, usize)>| -> Vec<u8> {
        places.flat_map(|(row, column)| value(row, column).to_le_bytes()).collect()
    };
    let by_row = (0..n).flat_map(|row| (0..columns).map(move |column| (row, column)));
    match data {
        "ascii" => {
            for row in 0..n {
                let words: Vec<String> = (0..columns).map(|column| value(row, column).to_string()).collect();
                bytes.extend(words.join(" ").bytes().chain([b'\n']));
            }
        }
        "binary" => bytes.extend(doubles(&mut { by_row })),
        _ => {
            let mut by_column = (0..columns).flat_map(|column| (0..n).map(move |row| (row, column)));
            let plain = doubles(&mut by_column);
            // Runs of literals: nothing is saved, but it is LZF.
            let packed: Vec<u8> = plain
                .chunks(32)
                .flat_map(|run| std::iter::once(run.len() as u8 - 1).chain(run.iter().copied()))
                .collect();
            bytes.extend((packed.len() as u32).to_le_bytes());
            bytes.extend((plain.len() as u32).to_le_bytes());
            bytes.extend(packed);
        }
    }
    bytes
}

/// An E57 file of one scan.
pub fn e57(points: &[DVec3]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, "ndf").expect("memory can be written to");
    let prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut scan = writer.add_pointcloud("scan", prototype).expect("the prototype is valid");
    for p in points {
        let values = p.to_array().map(RecordValue::Double).to_vec();
        scan.add_point(values).expect("memory can be written to");
    }
    scan.finalize().expect("memory can be written to");
    writer.finalize().expect("memory can be written to");
    drop(writer);
    file.into_inner()
}

/// A LAS or LAZ file.
pub fn las(points: &[DVec3], compressed: bool) -> Vec<u8> {
    let mut builder = Builder::from((1, 2));
    builder.point_format.is_compressed = compressed;
    let header = builder.into_header().expect("the header is valid");
    let mut writer = Writer::new(Cursor::new(Vec::new()), header).expect("memory can be written to");
    for p in points {
        let point = Point { x: p.x, y: p.y, z: p.z, ..Point::default() };
        writer.write_point(point).expect("memory can be written to");
    }
    writer.into_inner().expect("memory can be written to").into_inner()
}

/// A file of every format, with its name.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let points: Vec<DVec3> =
        (0..20).map(|i| (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract()).collect();
    let text: String = points.iter().map(|p| format!("{} {} {} 0 0 1\n", p.x, p.y, p.z)).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 20\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nend_header\n";
    vec![
        ("xyz", text.clone().into_bytes()),
        ("ply", format!("{header}{text}").into_bytes()),
        ("ascii.pcd", pcd(&points, Some(DVec3::Z), "ascii")),
        ("binary.pcd", pcd(&points, Some(DVec3::Z), "binary")),
        ("compressed.pcd", pcd(&points, None, "binary_compressed")),
        ("e57", e57(&points)),
        ("las", las(&points, false)),
        ("laz", las(&points, true)),
    ]
}
