//! Our block Lanczos beside faer's Krylov–Schur iteration, both with the same factor and the kernel of the Laplacian taken
//! out, on a sphere, whose eigenvalues are multiple, and on meshes given by path, as a table:
//! `RAYON_NUM_THREADS=1 cargo bench -p ndf-spectral --bench krylov -- MESH…`. The smaller of two times is given, without
//! the factorisation.

use std::time::Instant;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::LinOp;
use faer::matrix_free::eigen::{partial_self_adjoint_eigen, partial_self_adjoint_eigen_scratch};
use faer::{Col, Mat, MatMut, MatRef, Par};
use ndf_core::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, io, shapes};
use ndf_spectral::{LaplaceBeltrami, ModeOptions, Modes, OperatorOptions, ScreenedPoisson};

const RUNS: usize = 2;

#[allow(clippy::print_stdout, reason = "a table is what it makes")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| mesh | vertices | modes | ours, s | residual | faer, s | residual | converged | eigenvalues differ by |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    let mut meshes = vec![("sphere".to_owned(), shapes::icosphere(5))];
    for path in std::env::args().skip(1).filter(|a| !a.starts_with("--")) {
        meshes.push((path.clone(), io::read_mesh(&path)?.mesh));
    }
    for (name, mesh) in meshes {
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh)?);
        let operator = LaplaceBeltrami::new(&mesh, OperatorOptions::default())?;
        for count in [20, 100] {
            println!("{}", row(&name, &operator, count)?);
        }
    }
    Ok(())
}

/// A row of the table.
fn row(name: &str, operator: &LaplaceBeltrami, count: usize) -> Result<String, Box<dyn std::error::Error>> {
    let options = ModeOptions { count, verify: false, ..ModeOptions::default() };
    let factored = ScreenedPoisson::new(operator, options.shift_for(operator))?;
    let (mut ours, mut theirs) = (f64::INFINITY, f64::INFINITY);
    let mut modes = None;
    let mut values = Vec::new();
    let mut worst = 0.0;
    for _ in 0..RUNS {
        let found = timed(&mut ours, || factored.modes(&options, &NoProgress))?;
        (values, worst) = timed(&mut theirs, || krylov_schur(&factored, &found, options.tolerance));
        modes = Some(found);
    }
    let modes = modes.ok_or("no run")?;
    // That ours miss none is checked outside of the measured time.
    let verified = factored.modes(&ModeOptions { verify: true, ..options }, &NoProgress)?;
    assert!(verified.verified && verified.eigenvalues == modes.eigenvalues);
    let kernel = operator.components().count();
    let differences = modes.eigenvalues[kernel..].iter().zip(&values).map(|(a, b)| (a - b).abs() / a);
    Ok(format!(
        "| {name} | {} | {count} | {ours:.3} | {:.1e} | {theirs:.3} | {worst:.1e} | {} of {} | {:.1e} |",
        operator.vertex_count(),
        modes.max_residual(),
        values.len(),
        count - kernel,
        differences.fold(0.0, f64::max),
    ))
}

fn timed<T>(best: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *best = best.min(start.elapsed().as_secs_f64());
    result
}

/// faer's eigenvalues above the kernel that converged, ascending, and the largest residual `|Lφ − λMφ| / (λ |Mφ|)`. As
/// many are wanted as `ours` has, to the same tolerance relative to the smallest of them.
fn krylov_schur(factored: &ScreenedPoisson<'_>, ours: &Modes, tolerance: f64) -> (Vec<f64>, f64) {
    let operator = factored.operator();
    let inverse = SymmetricInverse {
        factored,
        // Lumped: one entry a row.
        roots: operator.mass().values().iter().map(|m| m.sqrt()).collect(),
    };
    let (n, wanted) = (operator.vertex_count(), ours.len() - operator.components().count());
    let last = 1.0 / (ours.eigenvalues[ours.len() - 1] + factored.shift());
    let start = Col::from_fn(n, |i| ((i as f64 + 1.0) * 0.618_033_988_749_895).fract() - 0.5);
    let mut start_image = Mat::zeros(n, 1);
    let mut memory =
        MemBuffer::new(partial_self_adjoint_eigen_scratch(&inverse, wanted, Par::Seq, Default::default()));
    let stack = MemStack::new(&mut memory);
    inverse.apply(start_image.as_mut(), start.as_mat(), Par::Seq, stack);
    let mut vectors = Mat::zeros(n, wanted);
    let mut values = vec![0.0; wanted];
    let found = partial_self_adjoint_eigen(
        vectors.as_mut(),
        &mut values,
        &inverse,
        start_image.col(0),
        tolerance * last,
        Par::Seq,
        stack,
        Default::default(),
    );
    values.truncate(found.n_converged_eigen);
    let mut worst: f64 = 0.0;
    for (k, value) in values.iter_mut().enumerate() {
        *value = value.recip() - factored.shift();
        let function: Vec<f64> =
            vectors.col(k).iter().zip(&inverse.roots).map(|(x, root)| x / root).collect();
        let (image, massed) = (operator.laplacian().multiply(&function), operator.mass().multiply(&function));
        let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
        let residual = norm(&mut image.iter().zip(&massed).map(|(l, m)| l - *value * m));
        worst = worst.max(residual / (*value * norm(&mut massed.iter().copied())));
    }
    (values, worst)
}

/// `M^½ (L + σM)⁻¹ M^½` without the kernel of L, whose eigenvalues are 1/(λ + σ).
#[derive(Debug)]
struct SymmetricInverse<'a> {
    factored: &'a ScreenedPoisson<'a>,
    roots: Vec<f64>,
}

impl LinOp<f64> for SymmetricInverse<'_> {
    fn apply_scratch(&self, _: usize, _: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.roots.len()
    }

    fn ncols(&self) -> usize {
        self.roots.len()
    }

    fn apply(&self, mut out: MatMut<'_, f64>, functions: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        for k in 0..functions.ncols() {
            let column = functions.col(k);
            let mut image: Vec<f64> = column.iter().zip(&self.roots).map(|(x, root)| x * root).collect();
            self.factored.cholesky().solve(&mut [&mut image]);
            self.factored.operator().remove_means(&mut image);
            for (i, (x, root)) in image.iter().zip(&self.roots).enumerate() {
                out[(i, k)] = x * root;
            }
        }
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, functions: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, functions, par, stack);
    }
}
