//! Every format is read as it was written, and every defect told.

#![cfg(feature = "full")]

use std::path::Path;

use ndf_core::DVec3;

use ndf_testing::data_path;

use super::*;

/// Reads bytes as points; the error as its sentence.
fn parse(bytes: &[u8]) -> Result<CloudFile, String> {
    parse_cloud(bytes, Path::new("cloud"), &CloudOptions::default()).map_err(|e| e.to_string())
}

fn points() -> Vec<DVec3> {
    (0..6).map(|i| DVec3::new(f64::from(i), 0.5 * f64::from(i * i), -f64::from(i % 3))).collect()
}

/// Reads bytes and expects the points, and their number for normals along them.
fn check(bytes: &[u8], format: CloudFormat, with_normals: bool) {
    let file = parse(bytes).unwrap();
    assert_eq!(file.format, format);
    let read = file.cloud.positions();
    assert_eq!(read.len(), points().len());
    for (a, b) in read.iter().zip(points()) {
        assert!(a.distance(b) < 1e-6, "{a} {b}");
    }
    let normals = file.cloud.normals();
    assert_eq!(normals.is_some(), with_normals);
    assert!(normals.is_none_or(|all| all.iter().all(|n| n.distance(DVec3::Y) < 1e-6)));
}

/// Every part of a file is refused in one sentence, or read as a smaller cloud where nothing tells that it was larger.
fn truncations_are_survived(bytes: &[u8], may_be_whole: impl Fn(usize) -> bool) {
    for end in 0..bytes.len() {
        match parse(&bytes[..end]) {
            Ok(_) => assert!(may_be_whole(end), "{end} of {} bytes were taken for a whole file", bytes.len()),
            Err(said) => assert!(said.contains("cloud") && !said.contains('\n'), "{said}"),
        }
    }
}

#[test]
fn text_is_read_in_all_its_dialects() {
    let lines = |line: &dyn Fn(DVec3) -> String| points().iter().map(|&p| line(p) + "\n").collect::<String>();
    let xyz = lines(&|p| format!("{} {} {}", p.x, p.y, p.z));
    let normals = lines(&|p| format!("{}\t{} {}  0 1 0 ", p.x, p.y, p.z));
    let comma = lines(&|p| format!("{},{},{}", p.x, p.y, p.z));
    for text in [
        xyz.clone(),
        format!("# points\n\n{xyz}"),
        format!("// points\n6\n{xyz}"),
        format!("x,y,z\n{comma}"),
        xyz.replace('\n', "\r\n"),
        xyz.replace('\n', "\r"),
        lines(&|p| format!("{} {} {} 17", p.x, p.y, p.z)),
        lines(&|p| format!("{};{};{};255;0;128", p.x, p.y, p.z)),
        lines(&|p| format!("{} {} {} 17 255 0 128", p.x, p.y, p.z)),
    ] {
        check(text.as_bytes(), CloudFormat::Text, false);
    }
    let pwn = format!("6\n{xyz}{}", "0 1 0\n".repeat(6));
    let coloured = lines(&|p| format!("{} {} {} 9 8 7 0 1.0000001 0", p.x, p.y, p.z));
    let longer = lines(&|p| format!("{} {} {} 0 2.5 0", p.x, p.y, p.z));
    for text in [normals, pwn, coloured, longer] {
        check(text.as_bytes(), CloudFormat::Text, true);
    }
}

#[test]
fn defects_of_text_are_told() {
    let xyz = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    for (text, said) in [
        (format!("7\n{xyz}"), "announces 7 points, but holds 4"),
        (format!("{xyz}1 2\n"), "line 5: it has 2 numbers"),
        (format!("{xyz}1 2 x\n"), "line 5: it holds something other than numbers"),
        ("1 2 3\n4 5 6\n".to_owned(), "2 of 2 points"),
        ("1 2 3\n".repeat(9), "1 of 9 points"),
        (String::new(), "it is empty"),
        ("once upon a time\n".to_owned(), "no known format"),
    ] {
        let error = parse(text.as_bytes()).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
    let survived = parse(format!("{xyz}nan 0 0\n0 inf 0\n").as_bytes()).unwrap();
    assert_eq!(survived.report.not_finite, 2);
}

#[test]
fn pcd_is_read_in_all_its_ways() {
    for data in ["ascii", "binary", "binary_compressed"] {
        check(&samples::pcd(&points(), Some(DVec3::Y), data), CloudFormat::Pcd, true);
        let bytes = samples::pcd(&points(), None, data);
        check(&bytes, CloudFormat::Pcd, false);
        // The last digits of the last number of a text can be missing unnoticed.
        let last_number = bytes.len() - 3;
        truncations_are_survived(&bytes, |end| data == "ascii" && end >= last_number);
    }
}

#[test]
fn defects_of_pcd_are_told() {
    let good = String::from_utf8(samples::pcd(&points(), None, "ascii")).unwrap();
    for (from, to, said) in [
        ("FIELDS x y z", "FIELDS x y w", "needs the fields x, y and z"),
        ("SIZE 8 8 8", "SIZE 8 8", "do not agree in number"),
        ("SIZE 8 8 8", "SIZE 8 3 8", "the field y"),
        ("TYPE F F F", "TYPE F X F", "the field y"),
        ("COUNT 1 1 1", "COUNT 1 99999999999 1", "the field y"),
        ("COUNT 1 1 1", "COUNT 1 2 1", "numbers instead of 4"),
        ("POINTS 6", "POINTS 18446744073709551615", "announces 18446744073709551615 points"),
        ("POINTS 6", "POINTS 9", "announces 9 points"),
        ("POINTS 6", "POINTS 7", "ends after 6 of 7"),
        ("POINTS 6", "POINTS many", "POINTS needs a number"),
        ("POINTS 6", "FLAVOUR sweet", "FLAVOUR is not a keyword"),
        ("DATA ascii", "DATA roman", "DATA roman is not known"),
        ("DATA ascii", "DATA binary", "follow the header"),
        ("DATA ascii", "DATA binary_compressed", "compressed"),
        ("\n0 0 ", "\n0 zero ", "is not a number"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        let error = parse(bad.as_bytes()).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn e57_is_read_and_its_truncations_refused() {
    let bytes = samples::e57(&points());
    check(&bytes, CloudFormat::E57, false);
    // Checksums of a page are looked at when the page is read; the last page is filled up.
    truncations_are_survived(&bytes, |_| false);
    for place in (0..bytes.len()).step_by(3) {
        let mut wrong = bytes.clone();
        wrong[place] ^= 0x5a;
        let _ = parse(&wrong);
    }
}

#[test]
fn las_and_laz_are_read_and_their_truncations_refused() {
    for compressed in [false, true] {
        let bytes = samples::las(&points(), compressed);
        check(&bytes, CloudFormat::Las, false);
        // What follows the last point of a LAZ file is the table of its chunks.
        truncations_are_survived(&bytes, |_| false);
        for place in 0..bytes.len() {
            for change in [0x01, 0xff] {
                let mut wrong = bytes.clone();
                wrong[place] ^= change;
                let _ = parse(&wrong);
            }
        }
    }
}

#[test]
fn points_that_a_las_file_marks_are_left_out() {
    use ::las::{Builder, Color, Point, Writer, point};
    for format in [0, 1, 6, 7] {
        let mut builder = Builder::from((1, 4));
        builder.point_format = point::Format::new(format).unwrap();
        let mut writer =
            Writer::new(std::io::Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
        for (i, p) in points().into_iter().enumerate() {
            let noise = [point::Classification::Ground, point::Classification::LowPoint][i % 2];
            let mut point = Point {
                x: p.x,
                y: p.y,
                z: p.z,
                classification: point::Classification::Building,
                ..Point::default()
            };
            point.gps_time = (format > 0).then_some(0.0);
            point.color = (format == 7).then(Color::default);
            writer.write_point(point.clone()).unwrap();
            // The same elsewhere, marked in one way or another.
            let is_withheld = i % 2 == 0;
            let marked = Point { x: 100.0 + p.x, classification: noise, is_withheld, ..point };
            writer.write_point(marked).unwrap();
        }
        let bytes = writer.into_inner().unwrap().into_inner();
        check(&bytes, CloudFormat::Las, false);
        let file = parse(&bytes).unwrap();
        assert_eq!((file.report.read, file.report.flagged), (12, 6));
        let all = CloudOptions { keep_flagged: true, ..CloudOptions::default() };
        let all = parse_cloud(&bytes, Path::new("cloud"), &all).unwrap();
        assert_eq!((all.cloud.positions().len(), all.report.flagged), (12, 0));
    }
}

#[test]
fn vertices_of_mesh_files_are_points() {
    let mut ply =
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nend_header\n"
            .to_owned();
    let mut obj = String::new();
    for p in points() {
        ply += &format!("{} {} {} 0 1 0\n", p.x, p.y, p.z);
        obj += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    check(ply.as_bytes(), CloudFormat::Vertices(MeshFormat::Ply), true);
    check(obj.as_bytes(), CloudFormat::Vertices(MeshFormat::Obj), false);
    truncations_are_survived(ply.as_bytes(), |end| end + 2 >= ply.len());
    let lacking = ply.replace("property float y\n", "");
    assert!(parse(lacking.as_bytes()).unwrap_err().contains("no property y"));
}

#[test]
fn nothing_panics_on_noise() {
    let seeds = samples::all();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as usize
    };
    for (_, seed) in &seeds {
        for _ in 0..300 {
            let mut bytes = seed.clone();
            for _ in 0..1 + next() % 4 {
                let place = next() % bytes.len();
                bytes[place] = next() as u8;
            }
            let _ = parse(&bytes);
        }
    }
}

#[test]
fn real_files_are_read() {
    let Some(folder) = data_path("points_raw") else { return };
    for (name, count, format) in [
        ("Armadillo_40000.xyz", 40_000, CloudFormat::Text),
        ("bunnyData.pts", 30_571, CloudFormat::Text),
        ("bunnyDouble.e57", 30_571, CloudFormat::E57),
        ("biwi_face_model.pcd", 100_000, CloudFormat::Pcd),
        ("capture0001_kinect.pcd", 249_647, CloudFormat::Pcd),
        ("ellipsoid.laz", 100_000, CloudFormat::Las),
    ] {
        // A third of the ellipsoid has the class of noise.
        let options = CloudOptions { keep_flagged: true, ..CloudOptions::default() };
        let file = read_cloud(folder.join(name), &options).unwrap();
        assert_eq!((file.cloud.positions().len(), file.format), (count, format), "{name}");
    }
    for name in ["bad_ZeroPoints.e57", "bad_bad-crc.e57", "bad_empty.e57"] {
        assert!(
            read_cloud(folder.join(name), &CloudOptions::default()).unwrap_err().to_string().contains(name)
        );
    }
    let bytes = std::fs::read(folder.join("capture0001_kinect.pcd")).unwrap();
    // The last bytes are padding.
    for end in (0..bytes.len() - 4096).step_by(bytes.len() / 40) {
        assert!(parse(&bytes[..end]).is_err());
    }
}
