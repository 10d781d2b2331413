//! Learning what was read, with progress, warnings and advice.

use std::path::Path;

use ndf::base::NoBaseMesh;
use ndf::{Fit, FitError, Fitted};
use ndf_meshing::BaseMeshError;
use ndf_model::levels::LevelsError;
use ndf_train::levels::LevelFitError;

use crate::context::Context;
use crate::files::LARGEST;
use crate::interrupt;
use crate::output::Failure;

/// The stages of opening and learning something.
pub const STAGES: [&str; 6] =
    ["orienting", "marching cubes", "decimation", "final pass", "sampling the field", "levels"];

/// Learns what was read from a file, with progress and warnings, from the beginning or from the checkpoint of this name. An
/// interrupted run gives what it has learned.
///
/// # Errors
/// If training fails, or is interrupted before it has begun.
pub fn learned(
    fit: Fit<'_>,
    path: &Path,
    resumed: Option<&Path>,
    context: &Context,
) -> Result<Fitted, Failure> {
    let name = path.display();
    let progress = context.progress().cancelled_by(interrupt::flag());
    fit.progress(&progress).on_note(|note| context.warn_of(&name, note)).run().map_err(|error| {
        let failure = Failure::new(format!("{name}: {error}"));
        match error {
            FitError::NoBaseMesh(NoBaseMesh::NoVolume { .. }) => {
                failure.try_instead("repair the mesh, or bring a base mesh of your own: `ndf fit --base`")
            }
            FitError::NoBaseMesh(NoBaseMesh::LeftOut(_)) => failure.try_instead(LARGEST),
            FitError::NoBaseMesh(NoBaseMesh::Making(
                BaseMeshError::NoField | BaseMeshError::Isosurface(_),
            )) => failure.try_instead("bring a base mesh of your own: `ndf fit --base`"),
            FitError::Levels(LevelFitError::OutOfReach) => {
                failure.try_instead("check that base mesh and input are in the same units")
            }
            FitError::Levels(LevelFitError::Levels(LevelsError::Faces)) => {
                failure.try_instead("ask for fewer with --base-faces")
            }
            FitError::OtherSurface => failure.try_instead(
                "give the input and the options that the run began with, or begin anew without --resume",
            ),
            FitError::Cancelled => match resumed {
                Some(checkpoint) => failure
                    .try_instead(&format!("{} is as it was; go on from it again", checkpoint.display())),
                None => failure.try_instead("nothing was learned, so there is no checkpoint to go on from"),
            },
            _ => failure,
        }
    })
}
