//! A perceptron on a grid of inputs. `cargo run --release -p ndf-network --example perceptron`

use ndf_network::{Activation, Mlp, MlpShape, ParameterCount};

fn main() -> Result<(), ParameterCount> {
    // Three hats make a triangle wave: max(x, 0) − 2 max(x − 1, 0) + max(x − 2, 0).
    let shape = MlpShape { inputs: 1, hidden: vec![3], outputs: 1, activation: Activation::Relu };
    let weights = [1.0, 1.0, 1.0, 0.0, -1.0, -2.0, 1.0, -2.0, 1.0, 0.0];
    let network = Mlp::new(shape, weights.to_vec())?;
    let inputs: Vec<f32> = (0..=10).map(|i| i as f32 * 0.25 - 0.25).collect();
    for (x, y) in inputs.iter().zip(network.evaluate(&inputs)) {
        eprintln!("{x:>5.2} {}", "*".repeat((20.0 * y) as usize));
    }
    Ok(())
}
