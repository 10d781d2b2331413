//! Projects the corners of a grid onto a torus: `cargo run -p ndf-core --example project`.

use ndf_core::analytic::Torus;
use ndf_core::{DVec3, Query, projected};

#[expect(clippy::print_stdout)]
fn main() {
    let torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };
    let coordinates = [-1.2, -0.4, 0.4, 1.2];
    let rows = |x| coordinates.map(|y| Query::at(DVec3::new(x, y, 0.5)));
    let queries: Vec<Query> = coordinates.into_iter().flat_map(rows).collect();
    for (query, answer) in queries.iter().zip(projected(&torus, &queries)) {
        match answer {
            Ok(foot) => println!("{} → {}", query.point, foot.point),
            Err(miss) => println!("{}: {miss}", query.point),
        }
    }
}
