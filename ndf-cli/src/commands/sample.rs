//! `ndf sample`: built-in shapes.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ndf_core::io::{VertexScalars, write_mesh};
use ndf_core::mesh::shapes;
use ndf_core::sampling::AreaSampler;
use ndf_core::{DVec3, TriangleMesh};
use serde_json::json;

use crate::context::Context;
use crate::output::{Failure, Outcome, grouped};

/// Arguments of `ndf sample`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// What to write.
    kind: Kind,
    /// The file to write; the extension of a mesh tells its format (.ply, .obj, .stl).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The shape.
    #[arg(long, value_enum, default_value_t)]
    shape: Shape,
    /// Points of a cloud.
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    points: u32,
}

/// The representations a shape can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A triangle mesh.
    Mesh,
    /// Points with outward normals (PLY).
    OrientedCloud,
    /// Points (PLY).
    Cloud,
}

/// The built-in shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Shape {
    /// A rope of three strands tied into a trefoil knot: genus 1, with fine grooves.
    #[default]
    Rope,
    /// A tube around the trefoil knot.
    Trefoil,
    /// A torus.
    Torus,
    /// A unit sphere.
    Sphere,
    /// A cube with sharp edges.
    Cube,
}

impl Shape {
    /// The shape as a closed mesh, oriented outward, of 12 to 96 thousand faces.
    pub fn mesh(self) -> TriangleMesh {
        match self {
            Self::Rope => shapes::rope_knot(800, 60, 0.24),
            Self::Trefoil => shapes::trefoil_knot(400, 36, 0.24),
            Self::Torus => shapes::torus(160, 80, 1.0, 0.4),
            Self::Sphere => shapes::icosphere(5),
            Self::Cube => shapes::cube(32),
        }
    }
}

/// Writes a shape.
///
/// # Errors
/// If the file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let mesh = arguments.shape.mesh();
    let (mesh, normals) = match arguments.kind {
        Kind::Mesh => (mesh, None),
        Kind::OrientedCloud | Kind::Cloud => {
            let (points, normals) = sampled(&mesh, arguments.points as usize, context.seed())?;
            (points, (arguments.kind == Kind::OrientedCloud).then_some(normals))
        }
    };
    let is_ply = arguments.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
    if arguments.kind != Kind::Mesh && !is_ply {
        let path = arguments.output.display();
        return Err(Failure::new(format!("a cloud is written as PLY; end the name of {path} in .ply")));
    }
    write_mesh(&arguments.output, &mesh, &normals.map_or(Vec::new(), |n| components(&n)))?;
    let (vertices, faces) = (mesh.vertex_count(), mesh.face_count());
    let path = arguments.output.display().to_string();
    let text = format!("{path}: {} vertices, {} faces\n", grouped(vertices), grouped(faces));
    Ok(Outcome::new(json!({"output": path, "vertices": vertices, "faces": faces}), text))
}

/// Points spread evenly over a mesh, as a mesh without faces, and the normals of their faces.
fn sampled(mesh: &TriangleMesh, count: usize, seed: u64) -> Result<(TriangleMesh, Vec<DVec3>), Failure> {
    let sampler = AreaSampler::new(mesh).expect("built-in shapes have area");
    let samples = sampler.sample(count, seed, 0);
    let positions = samples.iter().map(|s| s.position(mesh)).collect();
    let normals = samples.iter().map(|s| mesh.face_normal(s.face)).collect();
    Ok((TriangleMesh::new(positions, Vec::new())?, normals))
}

fn components(normals: &[DVec3]) -> Vec<VertexScalars> {
    let component = |(name, axis): (&str, usize)| VertexScalars {
        name: name.to_owned(),
        values: normals.iter().map(|n| n[axis] as f32).collect(),
    };
    [("nx", 0), ("ny", 1), ("nz", 2)].map(component).into()
}
