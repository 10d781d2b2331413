//! Small files of splats, made by code: for tests, and as seeds of fuzzers.

use super::{Splat, write_splats};

/// Two splats.
const TWO: [Splat; 2] = [
    Splat {
        center: [0.5, -0.25, 1.0],
        scales: [0.1, 0.2, 0.05],
        rotation: [1.0, 0.0, 0.0, 0.0],
        opacity: 0.8,
    },
    Splat {
        center: [-0.5, 0.25, 0.0],
        scales: [0.1, 0.1, 0.1],
        rotation: [0.5, 0.5, 0.5, 0.5],
        opacity: 0.6,
    },
];

/// Records of 32 bytes.
pub fn antimatter() -> Vec<u8> {
    let record = |splat: &Splat| {
        let mut bytes: Vec<u8> = splat
            .center
            .map(|x| x as f32)
            .iter()
            .chain(&splat.scales)
            .flat_map(|x: &f32| x.to_le_bytes())
            .collect();
        bytes.extend([128, 128, 128, (255.0 * splat.opacity) as u8]);
        bytes.extend(splat.rotation.map(|q| (q * 127.0 + 128.0) as u8));
        bytes
    };
    TWO.iter().flat_map(record).collect()
}

/// SPZ, packed only from version 4 on: two splats of which every attribute is zero bytes.
pub fn spz(version: u32) -> Vec<u8> {
    let position = if version == 1 { 6 } else { 9 };
    let rotation = if version < 3 { 3 } else { 4 };
    let streams = [position, 1, 3, 3, rotation].map(|size| vec![0; 2 * size]);
    // Degree of the harmonics, bits after the point, flags, number of streams.
    let last = if version < 4 { 12 << 8 } else { 12 << 8 | 5 << 24 };
    let words = [u32::from_le_bytes(*b"NGSP"), version, 2, last];
    let mut bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    if version < 4 {
        return [bytes, streams.concat()].concat();
    }
    let table = 32_u32;
    bytes.extend(table.to_le_bytes());
    bytes.resize(table as usize, 0);
    let packed = streams.clone().map(|stream| {
        ruzstd::encoding::compress_to_vec(stream.as_slice(), ruzstd::encoding::CompressionLevel::Fastest)
    });
    for (packed, stream) in packed.iter().zip(&streams) {
        bytes.extend([packed.len() as u64, stream.len() as u64].map(u64::to_le_bytes).concat());
    }
    [bytes, packed.concat()].concat()
}

/// The same bytes in gzip.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    let mut encoder = flate2::read::GzEncoder::new(bytes, flate2::Compression::fast());
    std::io::Read::read_to_end(&mut encoder, &mut packed).expect("memory can be written to");
    packed
}

/// PlayCanvas' PLY: one chunk, two splats at its lowest corner.
pub fn compressed_ply() -> Vec<u8> {
    let sides = |words: &str| -> String {
        ["min", "max"]
            .iter()
            .flat_map(|end| words.split(' ').map(move |axis| format!("property float {end}_{axis}\n")))
            .collect()
    };
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement chunk 1\n{}{}element vertex 2\n",
        sides("x y z"),
        sides("scale_x scale_y scale_z")
    );
    for name in ["position", "rotation", "scale", "color"] {
        bytes += &format!("property uint packed_{name}\n");
    }
    let mut bytes = (bytes + "end_header\n").into_bytes();
    for number in [-1.0_f32, -1.0, -1.0, 1.0, 1.0, 1.0, -3.0, -3.0, -3.0, -1.0, -1.0, -1.0] {
        bytes.extend(number.to_le_bytes());
    }
    for word in [0_u32, 0x2008_0200, 0, 0x8080_80ff].repeat(2) {
        bytes.extend(word.to_le_bytes());
    }
    bytes
}

/// `.ksplat` at a level of compression, with harmonics of the first degree: two splats, the second in a bucket that is not
/// full.
pub fn ksplat(level: u16) -> Vec<u8> {
    let word = |n: u32| n.to_le_bytes();
    let mut header = [[0, 1, 0, 0], word(1), word(1), word(2), word(2), word(u32::from(level))].concat();
    header.resize(4096, 0);
    // Splats, room, size and number of buckets, side of a bucket, bytes of its centre, range, size, full ones, others, degree.
    let section = [2, 2, 1, 2, 4.0_f32.to_bits(), 12, 32767, 0, 1, 1, 1].map(word).concat();
    header.extend(section);
    header.resize(4096 + 1024, 0);
    header.extend(word(1));
    let centers = [[0.0_f32, 0.0, 0.0], [-1.0, 0.0, 0.5]];
    header.extend(centers.iter().flatten().flat_map(|x| x.to_le_bytes()));
    for (splat, bucket) in TWO.iter().zip(centers) {
        let half = |x: f32| half::f16::from_f32(x).to_le_bytes();
        let floats = splat.scales.iter().chain(&splat.rotation);
        if level == 0 {
            header.extend(splat.center.iter().flat_map(|&x| (x as f32).to_le_bytes()));
            header.extend(floats.flat_map(|x| x.to_le_bytes()));
        } else {
            let steps = (0..3).map(|k| (splat.center[k] - f64::from(bucket[k])) * 32767.0 / 2.0 + 32767.0);
            header.extend(steps.flat_map(|x| (x.round() as u16).to_le_bytes()));
            header.extend(floats.flat_map(|&x| half(x)));
        }
        header.extend([128, 128, 128, (255.0 * splat.opacity) as u8]);
        header.extend(vec![0; 9 * [4, 2, 1][usize::from(level)]]);
    }
    header
}

/// A file of every format, with the end of its name.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let mut ply = Vec::new();
    write_splats(&mut ply, &TWO).expect("memory can be written to");
    vec![
        ("inria.ply", ply),
        ("compressed.ply", compressed_ply()),
        ("two.splat", antimatter()),
        ("plain.ksplat", ksplat(0)),
        ("half.ksplat", ksplat(1)),
        ("bytes.ksplat", ksplat(2)),
        ("v1.spz", gzip(&spz(1))),
        ("v2.spz", spz(2)),
        ("v3.spz", spz(3)),
        ("packed.spz", gzip(&spz(3))),
        ("v4.spz", spz(4)),
    ]
}
