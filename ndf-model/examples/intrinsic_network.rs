//! A function on a base mesh from features at its vertices: what the intrinsic encoding is.
//! `cargo run --release -p ndf-model --example intrinsic_network`

use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{ManifoldMesh, shapes};
use ndf_model::file::Precision;
use ndf_model::{ChannelIndex, IntrinsicNetwork, NetworkShape};
use ndf_network::Mlp;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let base = ManifoldMesh::try_from(shapes::torus(24, 12, 1.0, 0.4))?;
    let shape = NetworkShape { features: 2, ..NetworkShape::default() };
    let passes = shape.passes(1, ChannelIndex::Output);
    // Features that a training would find; here, the angles of the torus.
    let angles = base.positions().iter().flat_map(|p| [p.y.atan2(p.x), p.z.atan2(p.x.hypot(p.y) - 1.0)]);
    let features: Vec<f32> = angles.map(|angle| angle.cos() as f32).collect();
    let mlp = Mlp::kaiming(shape.mlp(passes), &mut ChaCha8Rng::seed_from_u64(1));
    let parameters = mlp.parameters().to_vec();
    let network = IntrinsicNetwork::new(base.vertex_count(), shape, passes, features, parameters)?;

    let points = AreaSampler::new(&base).ok_or("the torus has an area")?.sample(1000, 0, 0);
    let values = network.evaluate(&base, &points);
    for bits in [4, 8, 12] {
        let rounded = network.rounded(Precision::from_bits(bits)).evaluate(&base, &points);
        let worst = rounded.iter().zip(&values).fold(0.0_f32, |worst, (a, b)| worst.max((a - b).abs()));
        eprintln!("{bits:>2} bits a feature change values by {worst:.1e} at most");
    }
    Ok(())
}
