use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ndf_core::Cancelled;
use ndf_formats::point_cloud::{ReadError, TooFewPoints};
use ndf_mesh::io::FileDefect;
use ndf_mesh::{ManifoldMesh, TriangleMesh, Vertex, shapes};
use ndf_model::Model;
use ndf_train::{SettingsError, TrainError};

use super::*;
use crate::left_out::LeftOut;
use crate::{Kind, NoProgress, OpenOptions, open_bytes};

fn name() -> String {
    "file".to_owned()
}

fn path() -> PathBuf {
    "file".into()
}

/// An error of every kind.
fn one_of_each() -> Vec<Error> {
    let io = || std::io::Error::other("no");
    let malformed = |defect| ndf_mesh::io::ReadError::Malformed {
        path: path(),
        format: ndf_mesh::io::MeshFormat::Ply,
        defect,
    };
    let fin = TriangleMesh::new(shapes::icosphere(0).positions().to_vec(), vec![[0, 1, 2]; 3]);
    let not_manifold = ManifoldMesh::try_from(fin.unwrap()).unwrap_err();
    let out_of_range = TriangleMesh::new(Vec::new(), vec![[0, 1, 2]]).unwrap_err();
    let defects = [
        FileDefect::EndsEarly { items: "faces", expected: 2, found: 1 },
        FileDefect::Truncated("t".into()),
        FileDefect::TrailingBytes("t"),
        FileDefect::Checksum("t"),
        FileDefect::Syntax { line: 1, problem: "t".into() },
        FileDefect::LineIndex { line: 1, index: 3, vertices: 3 },
        out_of_range.into(),
        FileDefect::Missing("t".into()),
        FileDefect::Mismatch("t".into()),
        FileDefect::Value("t".into()),
        FileDefect::NotFinite("t"),
        FileDefect::TooLarge("t".into()),
        FileDefect::Unsupported("t".into()),
        FileDefect::Undecodable("t".into()),
        not_manifold.into(),
    ];
    let mut all: Vec<Error> = defects.map(|defect| OpenError::from(malformed(defect)).into()).into();
    all.extend([
        OpenError::Io { path: path(), source: io() }.into(),
        OpenError::Table { name: name() }.into(),
        NoModel { path: path(), what: None, source: ModelError::Version(9) }.into(),
        OpenError::CloudFile(ReadError::NotBuilt {
            path: path(),
            format: point_cloud::CloudFormat::E57,
            feature: "e57",
        })
        .into(),
        OpenError::Model { name: name() }.into(),
        NoMesh::NoFaces { path: path(), vertices: 3 }.into(),
        NoMesh::Other { path: path(), what: "a network" }.into(),
        OpenError::LeftOut { name: name(), source: LeftOut { share: 0.1 } }.into(),
        OpenError::NoArea { name: name() }.into(),
        OpenError::TooFar { name: name(), vertex: Vertex(0) }.into(),
        OpenError::CloudFile(ReadError::TooFewPoints {
            path: path(),
            source: TooFewPoints { flagged: 0, read: 3, kept: 3 },
        })
        .into(),
        OpenError::NoNormals { name: name() }.into(),
        OpenError::SplatFile { name: name(), source: SplatError::Empty }.into(),
        OpenError::Layout { name: name(), source: LayoutError::Unknown { found: name(), known: "nothing" } }
            .into(),
        OpenError::NoCode { name: name(), row: 1 }.into(),
        OpenError::OtherKind { name: name(), found: Kind::Nerf, asked: Kind::Neus }.into(),
        NoReference::NoField.into(),
        NoBaseMesh::Making(IsosurfaceError::NoCrossing { level: 0.0, evaluations: 1, cell: 1.0 }.into())
            .into(),
        FitError::from(TrainError::from(SettingsError::NoEpochs)).into(),
        DistanceError::NoVertex { vertex: Vertex(3), vertices: 3 }.into(),
        FitError::from(TrainError::OutOfReach { share: 0.0 }).into(),
        FitError::BaseFar { distance: 1.0 }.into(),
        FitError::from(TrainError::OtherTerm(name())).into(),
        FitError::from(TrainError::Diverged { epoch: 1 }).into(),
        ScalarsError::Taken { name: name(), with: name() }.into(),
        DistanceError::from(GeodesicError::Unreached { point: ndf_mesh::SurfacePoint::Vertex(Vertex(0)) })
            .into(),
        DistanceError::from(GeodesicError::PathLost { point: ndf_mesh::SurfacePoint::Vertex(Vertex(0)) })
            .into(),
        SpectralError::SolveNotConverged(1.0).into(),
        SpectralError::NotPositiveDefinite.into(),
        SpectralError::Degenerate.into(),
        SpectralError::OutOfMemory(1).into(),
        ExtractionError::from(Cancelled).into(),
        WriteError::UnknownExtension { path: path() }.into(),
    ]);
    all
}

#[test]
fn every_code_is_listed_once_and_appears() {
    let listed: BTreeSet<&str> = Error::CODES.iter().map(|(code, _)| *code).collect();
    assert_eq!(listed.len(), Error::CODES.len());
    assert_eq!(one_of_each().iter().map(Error::code).collect::<BTreeSet<_>>(), listed);
    let is_plain = |code: &&str| code.bytes().all(|b| b.is_ascii_lowercase() || b == b'_');
    assert!(listed.iter().all(is_plain));
}

#[test]
fn files_give_codes() {
    let code = |bytes: &[u8]| {
        let opened = open_bytes(bytes.to_vec(), Path::new("file"), &OpenOptions::default(), &NoProgress);
        Error::from(opened.err().unwrap()).code()
    };
    assert_eq!(code(b""), "unrecognised");
    assert_eq!(code(b"OFF\n3 1 0\n0 0 0\n"), "truncated");
    assert_eq!(code(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "index_out_of_range");
    assert_eq!(code(b"OFF\n3 1 0\n0 0 0\n1 0 zero\n"), "syntax");
    assert_eq!(code(b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "no_area");
    assert_eq!(code(b"\x89HDF\r\n\x1a\n and nothing more"), "undecodable");
    assert_eq!(code(b"# .PCD\nVERSION .7\nFIELDS x y\n"), "truncated");
    let model = |bytes: &[u8]| {
        let source = Model::from_bytes(bytes).err().unwrap();
        Error::from(NoModel { path: path(), what: None, source }).code()
    };
    assert_eq!(model(b"solid"), "unrecognised");
    assert_eq!(model(b"\x89NDF\r\n\x1a\n\x09\0\0\0\0\0\0\0"), "newer_version");
    assert_eq!(model(b"\x89NDF\r\n\x1a\n\x02\0\0\0"), "truncated");
}
