//! Files through which a peer gets its input and gives its values.

use std::path::{Path, PathBuf};
use std::process::Command;

use ndf_core::DVec3;
use ndf_fields::{Complex64, TangentBundle};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::ManifoldMesh;

/// A folder of raw little-endian arrays, which goes when it is dropped.
pub(crate) struct Exchange(PathBuf);

impl Exchange {
    pub(crate) fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("ndf-fields-peers-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the temporary folder can be written to");
        Self(folder)
    }

    pub(crate) fn write(&self, name: &str, numbers: &[f64]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(self.0.join(name), bytes).expect("the temporary folder can be written to");
    }

    pub(crate) fn write_numbers(&self, name: &str, numbers: &[u32]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(self.0.join(name), bytes).expect("the temporary folder can be written to");
    }

    pub(crate) fn write_complex(&self, name: &str, numbers: &[Complex64]) {
        self.write(name, &numbers.iter().flat_map(|z| [z.re, z.im]).collect::<Vec<_>>());
    }

    /// A mesh as it is in space and as its intrinsic Delaunay triangulation, with the directions of their half-edges.
    pub(crate) fn write_mesh(&self, mesh: &ManifoldMesh, bundle: &TangentBundle) {
        let positions: Vec<f64> = mesh.positions().iter().flat_map(DVec3::to_array).collect();
        self.write("positions", &positions);
        self.write_numbers("faces", &mesh.faces().concat());
        let directions = |bundle: &TangentBundle| {
            bundle.mesh().halfedges().map(|h| bundle.direction(h)).collect::<Vec<_>>()
        };
        self.write("directions", &directions(&TangentBundle::as_given(IntrinsicMesh::from_mesh(mesh))));
        let delaunay = bundle.mesh();
        let corners: Vec<u32> = delaunay.halfedges().map(|h| delaunay.tail(h).0).collect();
        self.write_numbers("delaunay-faces", &corners);
        let twins: Vec<u32> =
            delaunay.halfedges().map(|h| delaunay.twin(h).map_or(u32::MAX, |twin| twin.0)).collect();
        self.write_numbers("delaunay-twins", &twins);
        let lengths: Vec<f64> = delaunay.halfedges().map(|h| delaunay.halfedge_length(h)).collect();
        self.write("delaunay-lengths", &lengths);
        self.write("delaunay-directions", &directions(bundle));
    }

    /// Runs a script of this folder, which prints its version.
    pub(crate) fn run_python(&self, python: &Path, script: &str) -> String {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers").join(script);
        self.run(Command::new(python).arg(script))
    }

    /// Runs a program on the folder, on one thread.
    pub(crate) fn run(&self, command: &mut Command) -> String {
        command.arg(&self.0).env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1");
        let output = command.output().expect("the peer can be started");
        assert!(output.status.success(), "the peer failed: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    pub(crate) fn read(&self, name: &str) -> Vec<f64> {
        self.numbers(name, f64::from_le_bytes)
    }

    pub(crate) fn read_integers(&self, name: &str) -> Vec<i32> {
        self.numbers(name, i32::from_le_bytes)
    }

    pub(crate) fn read_complex(&self, name: &str) -> Vec<Complex64> {
        self.read(name).chunks_exact(2).map(|z| Complex64::new(z[0], z[1])).collect()
    }

    pub(crate) fn vectors(&self, name: &str) -> Vec<DVec3> {
        self.read(name).chunks_exact(3).map(DVec3::from_slice).collect()
    }

    fn numbers<T, const N: usize>(&self, name: &str, of_bytes: impl Fn([u8; N]) -> T) -> Vec<T> {
        let bytes = std::fs::read(self.0.join(name)).expect("the peer leaves its values");
        bytes.chunks_exact(N).map(|b| of_bytes(b.try_into().expect("so many bytes"))).collect()
    }
}

impl Drop for Exchange {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
