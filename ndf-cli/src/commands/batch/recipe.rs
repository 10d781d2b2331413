//! What a batch has to know of the commands that it gives its items to.

use clap::Args;

use crate::commands::{
    centre, convert, decimate, directions, extract, fit, geodesic, heat, info, laplacian, logmap, measure,
    mesh, remesh, render, repair, signed_distance, spectrum, stripes, transport,
};
use crate::context::Options;

/// A command of the program that takes one input.
#[derive(Debug)]
pub struct Recipe {
    /// Its name.
    pub name: &'static str,
    /// The ending of what it writes, if it writes something.
    pub extension: Option<&'static str>,
    /// Endings of what it may write beside that.
    pub beside: &'static [&'static str],
    /// Options that would have all items write to one file.
    pub shared: &'static [&'static str],
    /// The figure that says how wrong a result is, as a path through its JSON, and what that figure is.
    pub error: Option<(&'static str, &'static str)>,
    arguments: fn(clap::Command) -> clap::Command,
}

impl Recipe {
    /// The recipe of the command of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        RECIPES.into_iter().find(|recipe| recipe.name == name)
    }

    /// The command with its own and the common options, to parse with.
    pub fn command(&self) -> clap::Command {
        let command = clap::Command::new(self.name).bin_name(format!("ndf {}", self.name));
        let mut command = Options::augment_args((self.arguments)(command));
        command.build();
        command
    }

    /// Whether what it learns can be continued from a checkpoint.
    pub fn has_checkpoints(&self) -> bool {
        self.name == "fit"
    }

    /// A command that writes a file with this ending.
    const fn writing(
        name: &'static str,
        extension: &'static str,
        arguments: fn(clap::Command) -> clap::Command,
    ) -> Self {
        let extension = Some(extension);
        Self { name, extension, beside: &[], shared: &[], error: None, arguments }
    }

    /// A command that only prints.
    const fn printing(name: &'static str, arguments: fn(clap::Command) -> clap::Command) -> Self {
        Self { name, extension: None, beside: &[], shared: &[], error: None, arguments }
    }
}

static RECIPES: [&Recipe; 20] = [
    &FIT,
    &EXTRACT,
    &MESH,
    &GEODESIC,
    &SIGNED_DISTANCE,
    &CENTRE,
    &SPECTRUM,
    &DIRECTIONS,
    &STRIPES,
    &TRANSPORT,
    &LAPLACIAN,
    &LOGMAP,
    &HEAT,
    &CONVERT,
    &DECIMATE,
    &REMESH,
    &REPAIR,
    &RENDER,
    &INFO,
    &MEASURE,
];

const FARTHEST: (&str, &str) = ("hausdorff", "largest distance, in the units of the input");

/// `ndf fit`.
pub(super) static FIT: Recipe = Recipe {
    shared: &["--log"],
    error: Some(("projection_rms", "root mean square distance from the input, in the box [-1.5, 1.5]³")),
    ..Recipe::writing("fit", "ndf", fit::Arguments::augment_args)
};

/// `ndf extract`.
pub(super) static EXTRACT: Recipe = Recipe::writing("extract", "ply", extract::Arguments::augment_args);

/// `ndf mesh`.
pub(super) static MESH: Recipe = Recipe::writing("mesh", "ply", mesh::Arguments::augment_args);

/// `ndf geodesic`.
pub(super) static GEODESIC: Recipe = Recipe {
    beside: &["paths.ply"],
    shared: &["--paths"],
    ..Recipe::writing("geodesic", "ply", geodesic::Arguments::augment_args)
};

/// `ndf signed-distance`.
pub(super) static SIGNED_DISTANCE: Recipe =
    Recipe::writing("signed-distance", "ply", signed_distance::Arguments::augment_args);

/// `ndf centre`.
pub(super) static CENTRE: Recipe = Recipe::printing("centre", centre::Arguments::augment_args);

/// `ndf spectrum`.
pub(super) static SPECTRUM: Recipe = Recipe {
    error: Some(("residual_max", "largest relative residual of an eigenfunction")),
    ..Recipe::writing("spectrum", "ply", spectrum::Arguments::augment_args)
};

/// `ndf laplacian`.
pub(super) static LAPLACIAN: Recipe = Recipe {
    shared: &["--mass", "--mesh"],
    ..Recipe::writing("laplacian", "npz", laplacian::Arguments::augment_args)
};

/// `ndf directions`.
pub(super) static DIRECTIONS: Recipe =
    Recipe::writing("directions", "ply", directions::Arguments::augment_args);

/// `ndf stripes`.
pub(super) static STRIPES: Recipe = Recipe {
    // The vertices of one mesh.
    shared: &["--directions"],
    ..Recipe::writing("stripes", "ply", stripes::Arguments::augment_args)
};

/// `ndf transport`.
pub(super) static TRANSPORT: Recipe = Recipe::writing("transport", "ply", transport::Arguments::augment_args);

/// `ndf logmap`.
pub(super) static LOGMAP: Recipe = Recipe::writing("logmap", "ply", logmap::Arguments::augment_args);

/// `ndf heat`.
pub(super) static HEAT: Recipe = Recipe::writing("heat", "ply", heat::Arguments::augment_args);

/// `ndf convert`.
pub(super) static CONVERT: Recipe =
    Recipe::writing("convert", "safetensors", convert::Arguments::augment_args);

/// `ndf decimate`.
pub(super) static DECIMATE: Recipe =
    Recipe { error: Some(FARTHEST), ..Recipe::writing("decimate", "ply", decimate::Arguments::augment_args) };

/// `ndf remesh`.
pub(super) static REMESH: Recipe =
    Recipe { error: Some(FARTHEST), ..Recipe::writing("remesh", "ply", remesh::Arguments::augment_args) };

/// `ndf repair`.
pub(super) static REPAIR: Recipe =
    Recipe { shared: &["--map"], ..Recipe::writing("repair", "ply", repair::Arguments::augment_args) };

/// `ndf render`.
pub(super) static RENDER: Recipe = Recipe::writing("render", "png", render::Arguments::augment_args);

/// `ndf info`.
pub(super) static INFO: Recipe = Recipe::printing("info", info::Arguments::augment_args);

/// `ndf measure`, of which every input is the second.
pub(super) static MEASURE: Recipe = Recipe {
    error: Some(FARTHEST),
    shared: &["--output"],
    ..Recipe::printing("measure", measure::Arguments::augment_args)
};

#[cfg(test)]
mod tests {
    use super::*;

    /// What a batch passes to every item, all of these commands take.
    #[test]
    fn every_command_takes_what_a_batch_gives_it() {
        for recipe in RECIPES {
            let command = recipe.command();
            let has = |long: &str| command.get_arguments().any(|argument| argument.get_long() == Some(long));
            assert!(has("json") && has("quiet") && has("threads"), "{}", recipe.name);
            // What writes a file only when it is asked to writes none in a batch.
            let may_write = recipe.shared.contains(&"--output");
            assert_eq!(has("output"), recipe.extension.is_some() != may_write, "{}", recipe.name);
            assert_eq!(has("checkpoint") && has("resume"), recipe.has_checkpoints(), "{}", recipe.name);
            for shared in recipe.shared {
                assert!(has(shared.trim_start_matches('-')), "{}", recipe.name);
            }
        }
    }
}
