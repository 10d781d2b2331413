//! Where the nodes of a scene have its meshes.

use ndf_core::glam::{DAffine3, DMat4, DQuat, DVec3};

use super::super::FileDefect;
use super::Document;
use super::json::{Node, Root};

/// A mesh and where a node has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedMesh {
    /// The mesh, for [`Document::primitives`].
    pub mesh: u32,
    /// From its coordinates to those of the scene.
    pub affine: DAffine3,
    /// Whether a skeleton moves it. It is where its own coordinates say then, in the pose in which it was made.
    pub has_skin: bool,
}

impl Document<'_> {
    /// The meshes of the scene where its nodes have them; every mesh where it is, if no node has one. O(nodes).
    ///
    /// # Errors
    /// If nodes lead to what is not there, in circles, or to one node in two ways.
    pub fn placed_meshes(&self) -> Result<Vec<PlacedMesh>, FileDefect> {
        let Root { nodes, meshes, scenes, scene, .. } = &self.root;
        if nodes.iter().all(|node| node.mesh.is_none()) {
            let in_place = |mesh| PlacedMesh { mesh, affine: DAffine3::IDENTITY, has_skin: false };
            return Ok((0..meshes.len() as u32).map(in_place).collect());
        }
        let scene = scenes.get(scene.unwrap_or(0) as usize);
        let mut is_child = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|node| &node.children) {
            if let Some(is_child) = is_child.get_mut(child as usize) {
                *is_child = true;
            }
        }
        let roots: Vec<u32> = match scene {
            Some(scene) => scene.nodes.clone(),
            None => (0..nodes.len() as u32).filter(|&i| !is_child[i as usize]).collect(),
        };
        let mut waiting: Vec<(u32, DAffine3)> =
            roots.into_iter().rev().map(|i| (i, DAffine3::IDENTITY)).collect();
        let mut is_seen = vec![false; nodes.len()];
        let mut placed = Vec::new();
        while let Some((i, above)) = waiting.pop() {
            let missing = || FileDefect::mismatch(format!("it names node {i}, which is not there"));
            let node = nodes.get(i as usize).ok_or_else(missing)?;
            if std::mem::replace(&mut is_seen[i as usize], true) {
                return Err(FileDefect::mismatch(format!(
                    "node {i} is the child of two others, or of itself"
                )));
            }
            let affine = above * local(node);
            if let Some(mesh) = node.mesh {
                if mesh as usize >= meshes.len() {
                    return Err(FileDefect::mismatch(format!(
                        "node {i} has mesh {mesh}, which is not there"
                    )));
                }
                let has_skin = node.skin.is_some();
                let affine = if has_skin { DAffine3::IDENTITY } else { affine };
                placed.push(PlacedMesh { mesh, affine, has_skin });
            }
            waiting.extend(node.children.iter().rev().map(|&child| (child, affine)));
        }
        if scene.is_none() && is_seen.contains(&false) {
            return Err(FileDefect::mismatch("a node is the child of itself"));
        }
        Ok(placed)
    }
}

/// The transformation of a node in that of its parent: a matrix by columns, or translation, rotation and scale.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    let three =
        |given: &Option<Box<[f64; 3]>>, usual| given.as_deref().map_or(usual, |&x| DVec3::from_array(x));
    let rotation = node.rotation.as_deref().map_or(DQuat::IDENTITY, |&q| DQuat::from_array(q));
    let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(
        three(&node.scale, DVec3::ONE),
        rotation,
        three(&node.translation, DVec3::ZERO),
    )
}
