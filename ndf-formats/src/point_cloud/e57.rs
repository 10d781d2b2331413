//! E57 (ASTM E2807), read by the crate `e57`.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader, PointCloud, RecordName};
use ndf_core::DVec3;
use ndf_core::glam::DQuat;

use super::{FileDefect, Parsed, RawCloud};

/// Reads all scans of a file, each moved by its pose. Normals are read if all scans have them (the extension
/// `nor:normalX`, `normalY`, `normalZ`). Points the file marks as invalid become NaN.
pub(super) fn read(bytes: &[u8]) -> Parsed {
    let mut reader = E57Reader::new(Cursor::new(bytes)).map_err(undecodable)?;
    let scans = reader.pointclouds();
    if scans.is_empty() {
        return Err(FileDefect::missing("it holds no scan"));
    }
    let mut cloud = RawCloud::default();
    let mut normals = Vec::new();
    let mut all_have_normals = true;
    for scan in &scans {
        // Any number of points could be packed into no bits.
        if scan.records > bytes.len() as u64 {
            let text = format!("it announces {} points in {} bytes", scan.records, bytes.len());
            return Err(FileDefect::truncated(text));
        }
        let points = reader.pointcloud_simple(scan).map_err(undecodable)?;
        for point in points {
            cloud.positions.push(match point.map_err(undecodable)?.cartesian {
                CartesianCoordinate::Valid { x, y, z } => DVec3::new(x, y, z),
                _ => DVec3::NAN,
            });
        }
        match normal_records(scan) {
            Some(records) => {
                let turn = rotation(scan);
                for values in reader.pointcloud_raw(scan).map_err(undecodable)? {
                    let values = values.map_err(undecodable)?;
                    let component = |record: usize| {
                        values[record].to_f64(&scan.prototype[record].data_type).map_err(undecodable)
                    };
                    let [x, y, z] = records;
                    normals.push(turn * DVec3::new(component(x)?, component(y)?, component(z)?));
                }
            }
            None => all_have_normals = false,
        }
    }
    cloud.normals = all_have_normals.then_some(normals);
    Ok(cloud)
}

/// What the crate says.
fn undecodable(error: e57::Error) -> FileDefect {
    FileDefect::undecodable(error.to_string())
}

/// Which records of a point hold its normal.
fn normal_records(scan: &PointCloud) -> Option<[usize; 3]> {
    let named = |wanted: &str| {
        scan.prototype
            .iter()
            .position(|r| matches!(&r.name, RecordName::Unknown { name, .. } if name.ends_with(wanted)))
    };
    Some([named("normalX")?, named("normalY")?, named("normalZ")?])
}

fn rotation(scan: &PointCloud) -> DQuat {
    let pose = scan.transform.as_ref().map_or(DQuat::IDENTITY, |t| {
        DQuat::from_xyzw(t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w)
    });
    if pose.length_squared() > 0.0 { pose.normalize() } else { DQuat::IDENTITY }
}
