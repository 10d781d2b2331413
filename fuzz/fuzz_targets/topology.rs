//! Edits of a half-edge topology, which must stay a simplicial surface of the same kind.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_mesh::{Halfedge, ManifoldMesh, Topology, shapes};

fuzz_target!(|bytes: &[u8]| {
    let Some((&shape, edits)) = bytes.split_first() else { return };
    let mesh = match shape % 3 {
        0 => shapes::icosphere(1),
        1 => shapes::torus(5, 4, 1.0, 0.4),
        _ => shapes::grid(4, 3),
    };
    let mut topology: Topology = ManifoldMesh::try_from(mesh).expect("a manifold").topology().clone();
    let euler = topology.euler_characteristic();
    for edit in edits.chunks_exact(3).take(500) {
        let h = Halfedge::new(usize::from(u16::from_le_bytes([edit[1], edit[2]])) % topology.halfedge_count());
        match edit[0] % 4 {
            0 => drop(topology.insert_in_face(h.face())),
            1 => drop(topology.split_edge(h)),
            2 if topology.is_flippable(h) => drop(topology.flip(h)),
            3 if topology.is_collapsible(h) => {
                topology.collapse(h);
                topology.compact();
            }
            _ => {}
        }
        topology.check().expect("edits keep a surface");
        assert!(topology.is_simplicial());
        assert_eq!(topology.euler_characteristic(), euler);
    }
});
