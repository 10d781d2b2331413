//! What JavaScript calls: arrays are copied, errors are thrown.

#![allow(unreachable_pub, reason = "what is public is exported to JavaScript")]

use ndf::EdgeLength;
use ndf_mesh::io::VertexScalars;
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::surface;

/// Prepares the module: called once, by itself.
#[wasm_bindgen(start)]
pub fn start() {
    #[cfg(target_family = "wasm")]
    pulp::wasm::enable_simd128();
}

/// A model or a mesh that was opened, and the mesh that is computed on.
#[wasm_bindgen]
pub struct Surface(surface::Surface);

/// A shortest path.
#[wasm_bindgen]
pub struct Path(surface::Path);

/// Eigenvalues and modes.
#[wasm_bindgen]
pub struct Modes {
    values: Vec<f64>,
    functions: Vec<f32>,
}

#[wasm_bindgen]
impl Surface {
    /// Opens a model or a mesh. The first mesh of a model has the default edge length, or edges as long as the base mesh's: a
    /// sixteenth of the faces.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8], name: &str, is_coarse: bool) -> Result<Self, JsError> {
        let first = if is_coarse { EdgeLength::OfBase(1.0) } else { EdgeLength::default() };
        Ok(Self(surface::Surface::open_with(bytes, name, first)?))
    }

    /// What was opened, as JSON.
    pub fn describe(&self) -> Result<String, JsError> {
        Ok(serde_json::to_string(&self.0.describe())?)
    }

    /// Extracts another mesh of a model, with the default edge length, or this one in its units or in its box.
    pub fn extract(&mut self, length: Option<f64>, is_relative: bool) -> Result<(), JsError> {
        let length = match (length, is_relative) {
            (None, _) => EdgeLength::default(),
            (Some(length), true) => EdgeLength::Relative(length),
            (Some(length), false) => EdgeLength::World(length),
        };
        Ok(self.0.extract(length)?)
    }

    /// Figures of the mesh, as JSON.
    pub fn report(&self) -> String {
        self.0.report().to_string()
    }

    /// The positions of the vertices, x, y and z of each.
    pub fn vertices(&self) -> Vec<f32> {
        self.0.mesh().positions().iter().flat_map(|p| p.as_vec3().to_array()).collect()
    }

    /// The same in double precision.
    pub fn positions(&self) -> Vec<f64> {
        self.0.mesh().positions().iter().flat_map(ndf::DVec3::to_array).collect()
    }

    /// The corners of the faces, three of each.
    pub fn faces(&self) -> Vec<u32> {
        self.0.mesh().faces().as_flattened().to_vec()
    }

    /// Distances of all vertices from one.
    pub fn distances(&mut self, vertex: u32) -> Result<Vec<f32>, JsError> {
        Ok(self.0.distances(vertex)?)
    }

    /// The shortest path between two vertices.
    pub fn path(&mut self, from: u32, to: u32) -> Result<Path, JsError> {
        Ok(Path(self.0.path(from, to)?))
    }

    /// The first modes of the Laplacian.
    pub fn modes(&mut self, count: usize) -> Result<Modes, JsError> {
        let (values, functions) = self.0.modes(count)?;
        Ok(Modes { values, functions })
    }

    /// The values of a stored scalar.
    pub fn scalar(&self, name: &str) -> Result<Vec<f32>, JsError> {
        Ok(self.0.scalar(name)?.to_vec())
    }

    /// The mesh as a file: `ply` or `glb`, with the stored scalars and one more where its name and values are given.
    pub fn file(&self, format: &str, name: Option<String>, values: Vec<f32>) -> Result<Vec<u8>, JsError> {
        let further = name.map(|name| VertexScalars { name, values }).into_iter().collect();
        match format {
            "ply" => Ok(self.0.to_ply(further)?),
            "glb" => Ok(self.0.to_glb(further)?),
            other => Err(JsError::new(&format!("{other} is no format to write; ply and glb are"))),
        }
    }
}

#[wasm_bindgen]
impl Path {
    /// Its corners, x, y and z of each.
    #[wasm_bindgen(getter)]
    pub fn points(&self) -> Vec<f64> {
        self.0.points.clone()
    }

    /// Its length.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> f64 {
        self.0.length
    }
}

#[wasm_bindgen]
impl Modes {
    /// The eigenvalues.
    #[wasm_bindgen(getter)]
    pub fn values(&self) -> Vec<f64> {
        self.values.clone()
    }

    /// The modes at the vertices, one after the other.
    #[wasm_bindgen(getter)]
    pub fn functions(&self) -> Vec<f32> {
        self.functions.clone()
    }
}
