//! Places from which something starts.

use clap::{ArgGroup, Args};
use ndf::{DVec3, Place};

use super::point;

/// Where something starts from; of several the nearest counts.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[group(skip)]
pub struct Sources {
    /// Source: the surface's point closest to this one; may be given several times.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub source: Vec<DVec3>,
    /// Source: the vertex of the mesh file with this number, counted from 0; may be given several times.
    #[arg(long, value_name = "I")]
    pub source_vertex: Vec<u32>,
}

impl Sources {
    /// That at least one is given.
    pub fn required() -> ArgGroup {
        ArgGroup::new("sources").args(["source", "source_vertex"]).required(true).multiple(true)
    }

    /// The places, vertices first.
    pub fn places(&self) -> Vec<Place> {
        let vertices = self.source_vertex.iter().map(|&v| Place::Vertex(v.into()));
        vertices.chain(self.source.iter().copied().map(Place::Near)).collect()
    }

    /// What is asked for that only meshes have.
    pub fn only_of_meshes(&self) -> Option<&'static str> {
        (!self.source_vertex.is_empty()).then_some(Self::VERTICES)
    }

    /// Why vertices are no sources on other inputs.
    pub const VERTICES: &'static str =
        "--source-vertex counts the vertices of a mesh; say where with --source X,Y,Z";
}
