//! Checkpoints of frameworks that are not read, by the names of their tensors.

use super::state::State;

/// Parts of names, and what has them. Hash grids differ in the order and the scales of their levels, which no file says.
const FRAMEWORKS: [(&str, &str); 14] = [
    (
        "geometry.encoding",
        "a network of instant-nsr-pl with its own encoding, which is not read; export its mesh there",
    ),
    ("geometry.network", "a network of instant-nsr-pl, which is not read; export its mesh there"),
    (
        "field_coarse.mlp_base",
        "a vanilla-nerf of nerfstudio, which is not read; export its mesh with ns-export",
    ),
    (
        "field_fine.mlp_base",
        "a vanilla-nerf of nerfstudio, which is not read; export its mesh with ns-export",
    ),
    (
        "field.mlp_base",
        "a field of nerfstudio on a hash grid, which is not read; export its mesh with ns-export",
    ),
    ("neural_sdf.", "a network of Neuralangelo on a hash grid, which is not read; extract its mesh there"),
    ("encoder.embeddings", "a network of torch-ngp on a hash grid, which is not read; save its mesh there"),
    ("xyz_encoder.", "a network of ngp_pl on a hash grid, which is not read; export its mesh there"),
    ("density_plane.", "a TensoRF, which is not read; export its mesh there"),
    ("density.grid", "a grid of DirectVoxGO, which is not read; export its mesh there"),
    ("density_data", "a grid of Plenoxels, which is not read; export its mesh there"),
    ("proposal_networks.", "a field of nerfstudio, which is not read; export its mesh with ns-export"),
    (
        "hash_table",
        "a network on a hash grid of nerfstudio, which is not read; export its mesh with ns-export",
    ),
    ("tcnn_encoding", "a network on a hash grid of tiny-cuda-nn, which is not read; export its mesh there"),
];

/// What the checkpoint is, if the names say so.
pub(super) fn named(state: &State<'_>) -> Option<&'static str> {
    let is_there = |part: &str| {
        state.names().any(|name| name.match_indices(part).any(|(at, _)| at == 0 || name[..at].ends_with('.')))
    };
    FRAMEWORKS.iter().find(|(part, _)| is_there(part)).map(|(_, what)| *what)
}
