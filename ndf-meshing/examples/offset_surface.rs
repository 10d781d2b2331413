//! The base mesh of the surface at a distance around a mesh, as an example of a surface with a field:
//! `offset_surface INPUT OUTPUT RADIUS GRID FACES`, the radius relative to the diagonal of the mesh.

use std::error::Error;
use std::time::Instant;

use ndf_core::{
    Answer, BoundingBox, DVec3, Foot, Hint, ImplicitField, Inside, Miss, NoProgress, Query, Surface,
};
use ndf_mesh::io::{read_mesh, write_mesh};
use ndf_mesh::triangle_tree::TriangleTree;
use ndf_meshing::{BaseMeshOptions, MarchingCubesOptions, base_mesh};

struct Offset {
    tree: TriangleTree,
    radius: f64,
}

impl Surface for Offset {
    fn bounds(&self) -> BoundingBox {
        self.tree.bounds().padded(self.radius)
    }
    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let closest = self.tree.closest_point(query.point, query.hint);
            *foot = closest.ok_or(Miss::NotFinite).and_then(|c| {
                let normal = (query.point - c.point).try_normalize().ok_or(Miss::NoCrossing)?;
                Ok(Foot { point: c.point + normal * self.radius, normal, hint: c.hint() })
            });
        }
    }
    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(self)
    }
}

impl ImplicitField for Offset {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        let mut hint = Hint::NONE;
        for (&p, value) in points.iter().zip(values) {
            let closest = self.tree.closest_point(p, hint);
            *value = closest.map_or(f64::NAN, |c| c.distance_squared.sqrt());
            hint = closest.map_or(hint, |c| c.hint());
        }
    }
    fn bounds(&self) -> BoundingBox {
        Surface::bounds(self)
    }
    fn level(&self) -> f64 {
        self.radius
    }
    fn inside(&self) -> Inside {
        Inside::Below
    }
    fn lipschitz(&self) -> Option<f64> {
        Some(1.0)
    }
}

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, radius, grid, faces] = &arguments[..] else {
        return Err("usage: offset_surface INPUT OUTPUT RADIUS GRID FACES".into());
    };
    let mesh = read_mesh(input)?.mesh;
    let radius = radius.parse::<f64>()? * mesh.bounds().diagonal();
    let surface = Offset { tree: TriangleTree::new(&mesh), radius };
    let marching_cubes = MarchingCubesOptions { grid: grid.parse()?, ..Default::default() };
    let options = BaseMeshOptions { faces: faces.parse()?, marching_cubes, ..Default::default() };
    let begin = Instant::now();
    let base = base_mesh(&surface, &options, &NoProgress)?;
    println!("{:.3} s\n{:#?}", begin.elapsed().as_secs_f64(), base.report);
    write_mesh(output, &base.mesh, &[])?;
    Ok(())
}
