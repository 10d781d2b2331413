//! Dialects, names of columns, and what is a normal.

use super::super::{CloudFile, CloudFormat, CloudOptions, parse_cloud};
use super::*;

/// Points of an ellipsoid, with their normals.
fn points(count: u32) -> Vec<[DVec3; 2]> {
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (s, c) = (2.4 * f64::from(i)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let unit = DVec3::new(r * c, r * s, z);
            let axes = DVec3::new(1.0, 2.0, 3.0);
            [unit * axes, (unit / axes).normalize()]
        })
        .collect()
}

fn read_as(name: &str, text: &str, columns: Option<&str>) -> Result<CloudFile, String> {
    let columns = columns.map(|names| names.split(',').map(str::to_owned).collect());
    parse_cloud(text.as_bytes(), name.as_ref(), &CloudOptions { columns, ..CloudOptions::default() })
        .map_err(|e| e.to_string())
}

/// A text with a line for each point, after others.
fn text(before: &str, line: impl Fn(usize, DVec3, DVec3) -> String) -> String {
    let lines = points(60).into_iter().enumerate().map(|(i, [p, n])| line(i, p, n) + "\n");
    before.to_owned() + &lines.collect::<String>()
}

/// Reads a text and expects the points.
fn check(name: &str, text: &str, columns: Option<&str>, with_normals: bool) -> CloudFile {
    let file = read_as(name, text, columns).unwrap_or_else(|e| panic!("{e}:\n{}", &text[..200]));
    let found = file.cloud.positions();
    let start = &text[..text.len().min(120)];
    assert_eq!(found.len(), 60, "{start}");
    for (a, [b, _]) in found.iter().zip(points(60)) {
        assert!(a.distance(b) < 2e-5, "{a} instead of {b}: {start}");
    }
    assert_eq!(file.cloud.normals().is_some(), with_normals, "{start}");
    for (a, [_, b]) in file.cloud.normals().unwrap_or_default().iter().zip(points(60)) {
        assert!(a.distance(b) < 2e-5, "{a} instead of {b}: {start}");
    }
    file
}

fn vector(v: DVec3, separator: &str) -> String {
    format!("{:.6}{separator}{:.6}{separator}{:.6}", v.x, v.y, v.z)
}

#[test]
fn decimal_commas_are_decimal() {
    let comma = |v: DVec3, separator: &str| vector(v, separator).replace('.', ",");
    for (before, separator) in [("", " "), ("", "\t"), ("x;y;z\n", ";"), ("60\n", " "), ("X; Y; Z\n", "; ")] {
        check("a.xyz", &text(before, |_, p, _| comma(p, separator)), None, false);
        // A heading of three names leaves three columns without a meaning.
        let is_named = before.contains(['x', 'X']);
        let with_normals = text(before, |_, p, n| comma(p, separator) + separator + &comma(n, separator));
        check("a.xyz", &with_normals, None, !is_named);
    }
    // A whole number has no comma.
    check("a.xyz", &text("", |i, p, _| format!("{} {}", comma(p, " "), i % 3)), None, false);
    // Commas between numbers, with blanks or without.
    check("a.csv", &text("", |_, p, _| vector(p, ",")), None, false);
    check("a.csv", &text("", |_, p, _| vector(p, ", ")), None, false);
    let whole = read_as("a.csv", "1,2,3\n4,5,6\n7,8,9\n1,0,0\n", None).unwrap();
    assert_eq!(whole.cloud.positions()[1], DVec3::new(4.0, 5.0, 6.0));
}

/// A number with marks between groups of three digits.
fn grouped(x: f64, group: char, decimal: char) -> String {
    let text = format!("{:.6}", x.abs());
    let (whole, decimals) = text.split_once('.').unwrap();
    let digits: Vec<char> = whole.chars().collect();
    let groups: Vec<String> = digits.rchunks(3).rev().map(|group| group.iter().collect()).collect();
    let sign = if x < 0.0 { "-" } else { "" };
    format!("{sign}{}{decimal}{decimals}", groups.join(&group.to_string()))
}

#[test]
fn groups_of_digits_are_one_number() {
    let far = DVec3::new(-5_412_000.0, 390_000.0, 1_000.0);
    for (group, decimal) in [('.', ','), (',', '.')] {
        for (before, separator) in [("", " "), ("", ";"), ("x\ty\tz\n", "\t"), ("60\n", " ")] {
            let row = |p: DVec3| (p + far).to_array().map(|x| grouped(x, group, decimal)).join(separator);
            let file = read_as("a.txt", &text(before, |_, p, _| row(p)), None).unwrap();
            for (a, [b, _]) in file.cloud.positions().iter().zip(points(60)) {
                assert!(a.distance(b + far) < 2e-5, "{a} instead of {}: {before}{separator}", b + far);
            }
        }
    }
    // Whole numbers, below a thousand in some places.
    let whole = |i: u32| {
        [700 + 37 * i, 64_000 + i * i, 990 + i]
            .map(|x| grouped(f64::from(x), ',', '.').split('.').next().unwrap().to_owned())
    };
    let rows: String = (0..60).map(|i| whole(i).join(";") + "\n").collect();
    let file = read_as("a.txt", &rows, None).unwrap();
    assert_eq!(file.cloud.positions()[30], DVec3::new(1810.0, 64_900.0, 1020.0));
    // Three decimals, behind numbers of rows.
    let rows = text("", |i, p, _| format!("{i};{:.3};{:.3};{:.3}", p.x, p.y, p.z).replace('.', ","));
    assert!(read_as("a.txt", &rows, None).unwrap().cloud.positions()[30].distance(points(60)[30][0]) < 1e-3);
    // Points alone.
    let whole = |i: u32| {
        [700_000 + 37 * i, 64_000 + i * i, 1_990_123 + i]
            .map(|x| grouped(f64::from(x), '.', ',').split(',').next().unwrap().to_owned())
    };
    let rows: String = (0..60).map(|i| whole(i).join(";") + "\n").collect();
    let file = read_as("a.txt", &rows, None).unwrap();
    assert_eq!(file.cloud.positions()[30], DVec3::new(701_110.0, 64_900.0, 1_990_153.0));
    // Groups of any other length are no numbers.
    for rows in ["1.2345,5 2,0 3,0\n", "12.34,5 2,0 3,0\n", "1.234.5 2,0 3,0\n"] {
        assert!(read_as("a.txt", &rows.repeat(20), None).is_err(), "{rows}");
    }
    // Quotes part numbers from commas between them.
    let quoted = |p: DVec3| p.to_array().map(|x| format!("\"{x:.6}\"").replace('.', ",")).join(",");
    for before in ["", "x,y,z\n"] {
        check("a.csv", &text(before, |_, p, _| quoted(p)), None, false);
    }
    // Blanks, apostrophes and underscores.
    for (group, decimal, separator) in
        [(' ', ',', ";"), ('\'', '.', " "), ('\'', '.', ";"), ('_', '.', "\t"), ('\u{202f}', ',', ";")]
    {
        let row = |p: DVec3| (p + far).to_array().map(|x| grouped(x, group, decimal)).join(separator);
        let file = read_as("a.txt", &text("", |_, p, _| row(p)), None).unwrap();
        for (a, [b, _]) in file.cloud.positions().iter().zip(points(60)) {
            assert!(a.distance(b + far) < 2e-5, "{a} instead of {}: {group}", b + far);
        }
    }
}

#[test]
fn other_ways_to_write_points_are_read() {
    for (between, before, behind) in
        [(" | ", "", ""), (", ", "(", ")"), (" ", "[", "]"), (" ", "", " # a point"), (", ", "[", "],")]
    {
        let rows = text("", |_, p, _| format!("{before}{}{behind}", vector(p, between)));
        check("a.txt", &rows, None, false);
    }
    check("a.txt", &text("", |_, p, _| format!("{:.6}D+00 {:.6}d0 {:.6}", p.x, p.y, p.z)), None, false);
    // Commas before decimals and between numbers.
    check(
        "a.txt",
        &text("", |_, p, _| p.to_array().map(|x| format!("{x:.6}").replace('.', ",")).join(", ")),
        None,
        false,
    );
    // What made the file.
    check(
        "a.txt",
        &text("Instrument: a scanner\nDate: 2026-01-02\nPoints: 60\nUnit: m\n\n", |_, p, _| vector(p, " ")),
        None,
        false,
    );
}

#[test]
fn words_stand_beside_numbers_of_any_dialect() {
    let decimal = |p: DVec3, separator: &str| vector(p, separator).replace('.', ",");
    check(
        "a.txt",
        &text("Punkt\tOst\tNord\tHöhe\n", |i, p, _| format!("P{i}\t{}", decimal(p, "\t"))),
        None,
        false,
    );
    check("a.csv", &text("id;x;y;z\n", |i, p, _| format!("P{i};{}", decimal(p, ";"))), None, false);
    check(
        "a.csv",
        &text("Punktnummer;Rechtswert;Hochwert;Höhe;Code\n", |i, p, _| {
            format!("{i};{};Baum", decimal(p, ";"))
        }),
        None,
        false,
    );
    let grouped = |x: f64| grouped(x, ',', '.');
    let far = |p: DVec3| (p + 5e5).to_array().map(grouped).join(";");
    let named =
        read_as("a.csv", &text("Point;X [ft];Y [ft];Z [ft]\n", |i, p, _| format!("P{i};{}", far(p))), None);
    assert!(named.unwrap().cloud.positions()[7].distance(points(60)[7][0] + 5e5) < 2e-5);
}

#[test]
fn rows_with_gaps_are_left_out_and_counted() {
    let decimal = |x: f64| format!("{x:.6}").replace('.', ",");
    for (gap, count) in [("-", 1), ("*", 1), ("#N/A", 1), ("-nan(ind)", 1), ("1.#QNAN", 1), ("", 1)] {
        let rows = text("", |_, p, _| vector(p, ";"));
        let found = check("a.csv", &format!("{gap};1;2\n{rows}1;{gap};2\n"), None, false);
        // A line that begins with # is a comment.
        let expected = if gap.starts_with('#') { count } else { 2 * count };
        assert_eq!(found.report.not_finite, expected, "{gap}");
        let rows = text("", |_, p, _| p.to_array().map(decimal).join(";"));
        let found = check("a.csv", &format!("{rows}1,5;2,5;{gap}\n"), None, false);
        assert_eq!(found.report.not_finite, count, "{gap}");
        let found = check("a.csv", &format!("x;y;z\n{rows}1,5;{gap};2,5\n"), None, false);
        assert_eq!(found.report.not_finite, count, "{gap}");
    }
}

#[test]
fn no_row_is_taken_for_a_heading() {
    let rows = text("", |_, p, _| vector(p, ","));
    // What was not measured is left out, and counted.
    let lacking = check("a.csv", &format!("x,y,z\nNA,1,2\n,1,2\nNA,NA,2\n{rows}"), None, false);
    assert_eq!(lacking.report.not_finite, 3);
    let lacking = check("a.csv", &format!("NA,NA,NA\n{rows}nan,1,2\n"), None, false);
    assert_eq!(lacking.report.not_finite, 2);
    for (beginning, line) in [
        ("x,y,z\n1,2,abc\n", 2),
        ("x,y,z\n1,2\n", 2),
        ("1,2,abc\n", 1),
        ("a title\n1,2,abc\n", 2),
        ("1,2\n", 1),
    ] {
        let error = read_as("a.csv", &format!("{beginning}{rows}"), None).unwrap_err();
        assert!(error.contains(&format!("line {line}: ")), "{beginning}: {error}");
    }
    for heading in ["scan 3 of a bunny\n", "Scan 3\nx,y,z\n", "x,y,z\n[m],[m],[m]\n", "3 scans of bunnies\n"]
    {
        check("a.csv", &format!("{heading}{rows}"), None, false);
    }
    let turned = text("Scan 3\nz,y,x\n", |_, p, _| format!("{},{},{}", p.z, p.y, p.x));
    check("a.csv", &turned, None, false);
}

#[test]
fn names_of_rows_and_empty_fields_keep_columns_in_place() {
    // As R and pandas write them.
    for line in [
        &(|i, p: DVec3| format!("{i} {}", vector(p, " "))) as &dyn Fn(usize, DVec3) -> String,
        &|i, p| format!("\"{}\" {}", i + 1, vector(p, " ")),
        &|i, p| format!("p{i} {}", vector(p, " ")),
    ] {
        check("a.txt", &text("x y z\n", |i, p, _| line(i, p)), None, false);
        check("a.txt", &text("\"x\" \"y\" \"z\"\n", |i, p, _| line(i, p)), None, false);
    }
    check("a.tsv", &text("\tx\ty\tz\n", |i, p, _| format!("{i}\t{}", vector(p, "\t"))), None, false);
    // A fourth column without a name stays behind.
    let with_intensity = text("x y z\n", |i, p, _| format!("{} {}", vector(p, " "), 7 * i % 5));
    check("a.txt", &with_intensity, None, false);
    for separator in ["\t", ";", ","] {
        let heading = ["x", "y", "z"].join(separator) + "\n";
        let lacking = ["", "1", "2"].join(separator) + "\n" + &["1", "2", ""].join(separator) + "\n";
        let rows = text("", |_, p, _| vector(p, separator));
        let file = check("a.csv", &format!("{heading}{lacking}{rows}"), None, false);
        assert_eq!(file.report.not_finite, 2, "{separator:?}");
    }
    let noted = text("x,y,note,z\n", |_, p, _| format!("{},{},\"5, 6, 7\",{}", p.x, p.y, p.z));
    check("a.csv", &noted, None, false);
    let incomplete = text("1,2,,3\n", |_, p, _| vector(p, ",") + ",1");
    assert_eq!(check("a.csv", &incomplete, None, false).report.not_finite, 1);
    let first = text("name,x,y,z\nA,0.5,,\n", |i, p, _| format!("B{i},{}", vector(p, ",")));
    assert_eq!(check("a.csv", &first, None, false).report.not_finite, 1);
    let millions = text("", |_, p, _| (p * 1e6).to_array().map(|x| grouped(x.round(), ',', ' ')).join(";"));
    let whole = millions.replace(" 000000", "");
    let found = read_as("a.txt", &whole, None).unwrap();
    assert!(found.cloud.positions()[3].distance(points(60)[3][0] * 1e6) < 1.0);
}

#[test]
fn long_comments_and_any_end_of_line_are_passed_over() {
    let rows = text("", |_, p, _| vector(p, " "));
    let comments = "# said before the first row\n\n".repeat(1000);
    check("a.txt", &format!("{comments}{rows}"), None, false);
    for ends in [["\r", "\n"], ["\r\n", "\r"], ["\n", "\r\n"]] {
        let mixed: String = rows.lines().enumerate().map(|(i, row)| row.to_owned() + ends[i % 2]).collect();
        check("a.txt", &mixed, None, false);
    }
    let error = read_as("a.txt", "1 2 3\r4 5 6\r\n7 8 9\nabc\r", None).unwrap_err();
    assert!(error.contains("line 4: "), "{error}");
}

#[test]
fn numbers_of_rows_are_no_places() {
    for first in [0, 1] {
        let rows = text("", |i, p, n| format!("{},{},{}", i + first, vector(p, ","), vector(n, ",")));
        assert!(check("a.csv", &rows, None, true).report.numbered);
        let rows = text("", |i, p, _| format!("{} {}", i + first, vector(p, " ")));
        assert!(check("a.txt", &rows, None, false).report.numbered);
    }
    let rows = text("", |i, p, _| format!("{} {} {}", p.x, p.y, i));
    assert!(!read_as("a.txt", &rows, None).unwrap().report.numbered);
    // Numbers of what is left of a longer table.
    for number in [|i: usize| 2 * i, |i| i * i + 7, |i| 400 - i, |i| 10 + 7 * i % 60] {
        let rows = text("", |i, p, _| format!("{} {}", number(i), vector(p, " ")));
        assert!(check("a.txt", &rows, None, false).report.numbered);
    }
    // Places of voxels, and places in no order.
    for row in [|i: usize| [2 * i, i * i, i / 2, 0], |i| [7 * i % 60, i, i * i, 1]] {
        let rows = text("", |i, _, _| row(i).map(|x| x.to_string()).join(" "));
        assert!(!read_as("a.txt", &rows, None).unwrap().report.numbered);
    }
}

#[test]
fn numbers_of_columns_are_a_heading() {
    check("a.csv", &text("0,1,2\n", |_, p, _| vector(p, ",")), None, false);
    check(
        "a.csv",
        &text("0,1,2,3,4,5\n", |_, p, n| format!("{},{}", vector(p, ","), vector(n, ","))),
        None,
        true,
    );
    let indexed = check("a.csv", &text(",0,1,2\n", |i, p, _| format!("{i},{}", vector(p, ","))), None, false);
    assert!(indexed.report.numbered);
    // A voxel there.
    let voxels = (0..60).map(|i| format!("{},{},{}\n", i, i + 1, i + 2 + i % 7)).collect::<String>();
    assert_eq!(read_as("a.csv", &voxels, None).unwrap().cloud.positions().len(), 60);
}

#[test]
fn names_decide_what_columns_are() {
    let colmap = "# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
    let track =
        |i: usize, p: DVec3| format!("{} {} 9 8 7 0.5{}", i + 1, vector(p, " "), " 1 2".repeat(1 + i % 4));
    for (before, line) in [
        (
            "id,intensity,x,y,z\n",
            &(|i, p, _| format!("{i},7,{}", vector(p, ","))) as &dyn Fn(usize, DVec3, DVec3) -> String,
        ),
        ("time;z;y;x\n", &|i, p, _| format!("0.{i};{};{};{}", p.z, p.y, p.x)),
        ("\"Id\",\"X [m]\",\"Y [m]\",\"Z [m]\"\n", &|i, p, _| format!("\"P{i}\",{}", vector(p, ","))),
        ("name x y z\n", &|i, p, _| format!("p{i} {}", vector(p, " "))),
        ("Points:0,Points:1,Points:2\n", &|_, p, _| vector(p, ",")),
        ("# z y x\n", &|_, p, _| format!("{} {} {}", p.z, p.y, p.x)),
        ("label,x,y,z,comment\n", &|_, p, _| format!(",{},", vector(p, ","))),
        (colmap, &|i, p, _| track(i, p)),
        ("", &|i, p, _| track(i, p)),
        ("", &|i, p, _| format!("{} {} 9 8 7 0.5 1 2 1 2", i + 1, vector(p, " "))),
        ("// the words x, y and z in a sentence\n", &|_, p, _| vector(p, " ")),
        ("# points with x y z\n", &|_, p, _| vector(p, " ") + " 1 2 3"),
        ("a bunny\n", &|_, p, _| vector(p, " ")),
    ] {
        check("a.txt", &text(before, line), None, false);
    }
    for (before, line) in [
        (
            "//X Y Z Nx Ny Nz Intensity\n",
            &(|_, p, n| format!("{} {} 0.5", vector(p, " "), vector(n, " ")))
                as &dyn Fn(usize, DVec3, DVec3) -> String,
        ),
        ("X,Y,Z,R,G,B,Normal X,Normal Y,Normal Z\n", &|_, p, n| {
            format!("{},1,2,3,{}", vector(p, ","), vector(n, ","))
        }),
        ("normal_x normal_y normal_z x y z\n", &|_, p, n| format!("{} {}", vector(n, " "), vector(p, " "))),
    ] {
        check("a.asc", &text(before, line), None, true);
    }
    let lacking = read_as("a.csv", "id,time,intensity\n1,2,3\n4,5,6\n", None).unwrap_err();
    assert!(lacking.contains("id,time,intensity") && lacking.contains("--columns"), "{lacking}");
}

#[test]
fn the_caller_names_columns() {
    let turned = text("", |i, p, n| format!("{i} {} {} {} {}", p.z, p.y, p.x, vector(n, " ")));
    check("a.txt", &turned, Some("-,z,y,x,nx,ny,nz"), true);
    check("a.txt", &turned, Some("id,z,y,x"), false);
    // More than what the heading says.
    check("a.csv", &text("x,y,z\n", |_, p, _| format!("{},{},{}", p.y, p.x, p.z)), Some("y,x,z"), false);
    let words = text("", |i, p, _| format!("p{i} {}", vector(p, " ")));
    check("a.txt", &words, Some("name,x,y,z"), false);
    assert!(read_as("a.txt", &turned, Some("x,y")).unwrap_err().contains("do not say which are x, y and z"));
    let beyond = read_as("a.txt", "1 2 3\n4 5 6\n7 8 9\n", Some("a,b,c,x,y,z")).unwrap_err();
    assert!(beyond.contains("line 1: it has 3 columns, but column 4 is needed"), "{beyond}");
    let short = read_as("a.txt", "0 1 2 3\n0 4 5 6\n0 7 8\n", Some("a,x,y,z")).unwrap_err();
    assert!(short.contains("line 3: it has 3 columns, but column 4 is needed"), "{short}");
}

#[test]
fn colours_and_other_numbers_are_no_normals() {
    let unit = |i: usize| 0.5 + 0.5 * (1.3 * i as f64).sin();
    for further in [
        &(|i: usize| format!("{:.3} {:.3} {:.3}", unit(i), unit(i + 7), unit(i + 9)))
            as &dyn Fn(usize) -> String,
        // Labels in pure colours, greys, white.
        &|i| ["1 0 0", "0 1 0", "0 0 1"][i % 3].to_owned(),
        &|i| ["1.0 0.0 0.0", "0.0 1.0 0.0", "0.0 0.0 0.0"][i % 3].to_owned(),
        &|_| "0.5 0.5 0.5".to_owned(),
        &|_| "1 1 1".to_owned(),
        &|_| "255 255 255".to_owned(),
        &|i| format!("{} 0 128", i % 256),
        // Deviations, and returns of a laser.
        &|i| format!("{:.4} {:.4} {:.4}", 0.01 * unit(i), 0.02 * unit(i), 3.0 * unit(i + 1)),
        &|i| format!("{} 1 2", i % 3),
    ] {
        let cloud = text("", |i, p, _| format!("{} {}", vector(p, " "), further(i)));
        assert!(!check("a.txt", &cloud, None, false).report.unclear_columns);
        let with_intensity = text("", |i, p, _| format!("{} {i} {}", vector(p, " "), further(i)));
        check("a.txt", &with_intensity, None, false);
        // With normals after them, these are found.
        let with_normals =
            text("", |i, p, n| format!("{} {} {}", vector(p, " "), further(i), vector(n, " ")));
        check("a.txt", &with_normals, None, true);
    }
    let flow = text("", |i, p, n| format!("{} {}", vector(p, " "), vector(n * (0.5 + unit(i)), " ")));
    // Normals of any length are normals if they point to all sides.
    assert!(check("a.xyz", &flow, None, true).report.normals_scaled > 50);
    let one_sided =
        text("", |i, p, _| format!("{} {:.4} 0.5 {:.4}", vector(p, " "), unit(i) - 0.5, unit(i + 5)));
    let file = check("a.xyz", &one_sided, None, false);
    assert!(file.report.unclear_columns);
    check("a.pwn", &flow, None, true);
    let red = text("", |_, p, _| vector(p, " ") + " 1 0 0");
    check("a.xyzrgb", &red, None, false);
}

#[test]
fn marks_counts_and_scans_are_understood() {
    let plain = text("", |_, p, _| vector(p, " "));
    check("a.xyz", &format!("\u{feff}{plain}"), None, false);
    check("a.xyz", &format!("\u{feff}x y z\n{plain}"), None, false);
    let row = |i: usize, p: DVec3| format!("{} {i} 3 2 1", vector(p, " "));
    let scans = text("20\n", |i, p, _| if i == 19 { row(i, p) + "\n40" } else { row(i, p) });
    assert_eq!(check("a.pts", &scans, None, false).format, CloudFormat::Pts);
    let more = read_as("a.pts", &text("59\n", |i, p, _| row(i, p)), None).unwrap_err();
    assert!(
        more.contains("a.pts is not a valid PTS file: it announces 59 points, but holds 60; correct"),
        "{more}"
    );
    let fewer = read_as("a.pts", &scans.replace("\n40\n", "\n41\n"), None).unwrap_err();
    assert!(
        fewer.contains("the scan at line 22 announces 41 points, but holds 40; the file is cut off"),
        "{fewer}"
    );
}

#[test]
fn ptx_is_read_in_the_coordinates_of_its_scans() {
    let header =
        |n: usize| format!("{n}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n");
    // Turned by the matrix from x to y, then moved.
    let turned = |p: DVec3| DVec3::new(p.y - 20.0, 10.0 - p.x, p.z - 30.0);
    let one = text(&header(61), |_, p, _| vector(turned(p), " ") + " 0.5") + "0 0 0 0.5\n";
    assert_eq!(check("a.ptx", &one, None, false).format, CloudFormat::Ptx);
    let two = text(&header(20), |i, p, _| {
        let row = vector(turned(p), " ") + " 0.5 1 2 3";
        if i == 19 { row + "\n" + header(40).trim_end() } else { row }
    });
    check("a.ptx", &two, None, false);
    let cut = read_as("a.ptx", &two[..two.len() - 60], None).unwrap_err();
    assert!(cut.contains("a.ptx is not a valid PTX file"), "{cut}");
}
