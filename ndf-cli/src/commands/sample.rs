//! `ndf sample`: built-in shapes.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndf_core::DVec3;
use ndf_core::glam::DQuat;
use ndf_formats::splats::{Splat, write_splats};
use ndf_formats::tensors::made;
use ndf_formats::tensors::to_safetensors;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::{VertexScalars, atomic_write};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use serde_json::json;

use crate::context::Context;
use crate::output::{Failure, Outcome, grouped};
use crate::streams::output_file;

/// Arguments of `ndf sample`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// What to write.
    kind: Kind,
    /// The file to write; for a mesh the extension sets the format (.ply, .glb, .obj, .stl).
    #[arg(short, long, value_name = "FILE", value_parser = output_file("ply"))]
    output: PathBuf,
    /// The shape; networks are a sphere or a torus.
    #[arg(long, value_enum, default_value_t)]
    shape: Shape,
    /// Faces of the mesh, about: a sphere has 20·4ⁿ. By default 12 to 96 thousand.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(100..=100_000_000))]
    faces: Option<u32>,
    /// Points of a cloud, or splats.
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
    /// A network of the layout of NeuS (safetensors); a torus or a sphere.
    Neus,
    /// A radiance field of the layout of NeRF (safetensors); a torus or a sphere.
    Nerf,
    /// Gaussian splats (PLY).
    Splats,
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
    /// The shape as a closed mesh, oriented outward, of about so many faces, or of 12 to 96 thousand.
    pub fn mesh(self, faces: Option<u32>) -> TriangleMesh {
        // Of so many segments one way and so many the other: twice their product, and of a cube six sides.
        let finer = |[one, other]: [u32; 2], sides: u32| {
            let usual = f64::from(2 * sides * one * other);
            let factor = faces.map_or(1.0, |faces| (f64::from(faces) / usual).sqrt());
            [one, other].map(|n| ((f64::from(n) * factor).round() as u32).max(3))
        };
        match self {
            Self::Rope => {
                let [along, around] = finer([800, 60], 1);
                shapes::rope_knot(along, around, 0.24)
            }
            Self::Trefoil => {
                let [along, around] = finer([400, 36], 1);
                shapes::trefoil_knot(along, around, 0.24)
            }
            Self::Torus => {
                let [major, minor] = finer([160, 80], 1);
                shapes::torus(major, minor, 1.0, 0.4)
            }
            Self::Sphere => shapes::icosphere(faces.map_or(5, |faces| {
                let levels = (f64::from(faces) / 20.0).log(4.0).round();
                levels.max(0.0) as u32
            })),
            Self::Cube => shapes::cube(finer([32, 32], 6)[0]),
        }
    }
}

/// Writes a shape.
///
/// # Errors
/// If the shape cannot be had in that kind, or the file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    match arguments.kind {
        Kind::Neus | Kind::Nerf => return write_network(arguments),
        Kind::Splats => return write_splat_file(arguments, context),
        _ => {}
    }
    let mesh = arguments.shape.mesh(arguments.faces);
    let (mesh, normals) = match arguments.kind {
        Kind::OrientedCloud | Kind::Cloud => {
            ply_only(arguments, "a cloud")?;
            let (points, normals) = sampled(&mesh, arguments.points as usize, context.seed())?;
            (points, (arguments.kind == Kind::OrientedCloud).then_some(normals))
        }
        _ => (mesh, None),
    };
    context.write_mesh(&arguments.output, &mesh, &normals.map_or(Vec::new(), |n| components(&n)))?;
    let (vertices, faces) = (mesh.vertex_count(), mesh.face_count());
    let path = arguments.output.display().to_string();
    let text = format!("{path}: {} vertices, {} faces\n", grouped(vertices), grouped(faces));
    Ok(Outcome::new(json!({"output": path, "vertices": vertices, "faces": faces}), text))
}

fn ply_only(arguments: &Arguments, what: &str) -> Result<(), Failure> {
    let is_ply = arguments.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
    let path = arguments.output.display();
    if is_ply {
        Ok(())
    } else {
        Err(Failure::new(format!("{what} is written as PLY; end the name of {path} in .ply")))
    }
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    atomic_write(path, |out| out.write_all(bytes))
        .map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))
}

/// A torus or sphere as a network whose weights are known.
fn write_network(arguments: &Arguments) -> Result<Outcome, Failure> {
    let torus = match arguments.shape {
        Shape::Torus => made::Torus { ring: 0.6, tube: 0.25 },
        // The default of the other kinds has no such network.
        Shape::Sphere | Shape::Rope => made::Torus { ring: 0.0, tube: 0.7 },
        Shape::Trefoil | Shape::Cube => {
            let failure = Failure::new("no network is known for this shape");
            return Err(failure.try_instead("--shape torus and --shape sphere have one"));
        }
    };
    let tensors = if arguments.kind == Kind::Neus { torus.as_neus() } else { torus.as_nerf() };
    let bytes = to_safetensors(&tensors).map_err(|e| Failure::new(e.to_string()))?;
    write_file(&arguments.output, &bytes)?;
    let parameters: usize = tensors.iter().map(|(_, tensor)| tensor.values().len()).sum();
    let path = arguments.output.display().to_string();
    let text = format!("{path}: {} parameters\n", grouped(parameters));
    Ok(Outcome::new(json!({"output": path, "parameters": parameters}), text))
}

/// Flat splats spread evenly over a shape.
fn write_splat_file(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    ply_only(arguments, "a cloud of splats")?;
    let mesh = arguments.shape.mesh(arguments.faces);
    let (points, normals) = sampled(&mesh, arguments.points as usize, context.seed())?;
    // Every splat covers its share of the area.
    let radius = (mesh.area() / f64::from(arguments.points)).sqrt() as f32;
    let splats: Vec<Splat> = points
        .positions()
        .iter()
        .zip(&normals)
        .map(|(p, &n)| {
            let turn = DQuat::from_rotation_arc(DVec3::Z, n.normalize_or(DVec3::Z)).as_quat();
            let rotation = [turn.w, turn.x, turn.y, turn.z];
            Splat {
                center: p.as_vec3().as_dvec3().to_array(),
                scales: [radius, radius, 0.1 * radius],
                rotation,
                opacity: 0.9,
            }
        })
        .collect();
    let mut bytes = Vec::new();
    write_splats(&mut bytes, &splats).map_err(|e| Failure::new(e.to_string()))?;
    write_file(&arguments.output, &bytes)?;
    let path = arguments.output.display().to_string();
    let text = format!("{path}: {} splats\n", grouped(splats.len()));
    Ok(Outcome::new(json!({"output": path, "splats": splats.len()}), text))
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
