//! The options after `--`, which every item is given: checked before anything starts, and taken apart where a process needs
//! only some of them.

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction};

use super::recipe::Recipe;

/// The words of a command line for one item, the last two of which are its input.
pub(super) fn command_line(
    recipe: &Recipe,
    input: &str,
    output: Option<&str>,
    threads: usize,
    flags: &[String],
) -> Vec<String> {
    let mut words = vec![recipe.name.to_owned()];
    words.extend_from_slice(flags);
    if let Some(output) = output {
        words.extend(["-o".to_owned(), output.to_owned()]);
    }
    words.extend(["--json", "--quiet", "--threads"].map(str::to_owned));
    words.extend([threads.to_string(), "--".to_owned(), input.to_owned()]);
    words
}

/// Whether the command takes these options.
///
/// # Errors
/// As the command's own, or if an option is one that the batch gives its items itself.
pub(super) fn check(recipe: &Recipe, flags: &[String], extension: Option<&str>) -> Result<(), clap::Error> {
    let mut command = recipe.command();
    for flag in flags {
        if let Some(advice) = reserved(recipe, flag) {
            let name = recipe.name;
            let message = format!("'{flag}' cannot be given to all items of `ndf batch {name}`: {advice}");
            return Err(command.error(ErrorKind::ArgumentConflict, message));
        }
    }
    let words = stand_in(recipe, flags, extension);
    let without_input = &words[..words.len() - 2];
    if command.try_get_matches_from_mut(without_input).is_ok() {
        let message = "inputs stand before `--`, and only options after it";
        return Err(command.error(ErrorKind::ArgumentConflict, message));
    }
    command.try_get_matches_from_mut(&words).map(drop)
}

/// The words of a command line where there is no item yet.
fn stand_in(recipe: &Recipe, flags: &[String], extension: Option<&str>) -> Vec<String> {
    let output = extension.map(|extension| format!("OUTPUT.{extension}"));
    command_line(recipe, "INPUT", output.as_deref(), 1, flags)
}

/// What to do in place of giving this option to the items.
fn reserved(recipe: &Recipe, flag: &str) -> Option<&'static str> {
    let name = flag.split('=').next().unwrap_or(flag);
    match name {
        _ if name.starts_with("-o") || name == "--output" => Some(
            "each has its own output below the folder of the batch; --extension before `--` sets their kind",
        ),
        "--json" | "--quiet" => Some("they have it already; before `--` it is about the batch itself"),
        "--threads" => Some("give it before `--`, where it is about each of them"),
        "--resume" => Some("give it before `--`, where it resumes the batch and what it was learning"),
        "--checkpoint" => {
            Some("the batch keeps a checkpoint of each; --resume before `--` goes on from them")
        }
        _ if recipe.shared.contains(&name) => Some("they would all write to the same file"),
        _ => None,
    }
}

/// Those of the options that may stand beside `--resume`. The others are in the checkpoint.
pub(super) fn beside_resume(recipe: &Recipe, flags: &[String]) -> Vec<String> {
    let command = recipe.command();
    let resume = command.get_arguments().find(|argument| argument.get_id() == "resume");
    let conflicting: Vec<&str> = resume.map_or_else(Vec::new, |resume| {
        command
            .get_arg_conflicts_with(resume)
            .into_iter()
            .map(|argument| argument.get_id().as_str())
            .collect()
    });
    selected(recipe, flags, |argument| !conflicting.contains(&argument.get_id().as_str()))
}

/// Those of the options that another command has under the same name.
pub(super) fn shared_with(recipe: &Recipe, flags: &[String], other: &clap::Command) -> Vec<String> {
    selected(recipe, flags, |argument| {
        other.get_arguments().any(|other| {
            other.get_id() == argument.get_id() && other.get_value_names() == argument.get_value_names()
        })
    })
}

/// The options that are chosen, each written with its long name.
fn selected(recipe: &Recipe, flags: &[String], is_chosen: impl Fn(&Arg) -> bool) -> Vec<String> {
    let mut command = recipe.command();
    let words = stand_in(recipe, flags, recipe.extension);
    let Ok(matches) = command.try_get_matches_from_mut(words) else { return Vec::new() };
    let is_own = |argument: &&Arg| {
        let id = argument.get_id().as_str();
        matches.value_source(id) == Some(ValueSource::CommandLine)
            && !["output", "json", "quiet", "threads"].contains(&id)
    };
    let mut words = Vec::new();
    for argument in command.get_arguments().filter(is_own).filter(|argument| is_chosen(argument)) {
        let Some(long) = argument.get_long() else { continue };
        match argument.get_action() {
            ArgAction::SetTrue => words.push(format!("--{long}")),
            _ => {
                let values = matches.get_raw(argument.get_id().as_str()).into_iter().flatten();
                words.extend(values.map(|value| format!("--{long}={}", value.to_string_lossy())));
            }
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    fn refused(name: &str, flags: &str) -> String {
        let recipe = Recipe::named(name).unwrap();
        check(recipe, &words(flags), recipe.extension).unwrap_err().to_string()
    }

    #[test]
    fn options_are_those_of_the_command() {
        let fit = Recipe::named("fit").unwrap();
        assert!(check(fit, &words("--base-faces 4000 --seed 3 --as mesh"), Some("ndf")).is_ok());
        assert!(refused("fit", "--modes 3").contains("--modes"));
        assert!(refused("fit", "--base-faces x").contains("--base-faces"));
        assert!(refused("fit", "--size 9000 --error 1%").contains("cannot be used with"));
        assert!(refused("geodesic", "").contains("--source"));
        assert!(refused("info", "other.ply").contains("inputs stand before"));
        // One mesh for all is a matter of `measure`.
        let measure = Recipe::named("measure").unwrap();
        assert!(check(measure, &words("reference.ply --samples 10"), None).is_ok());
    }

    #[test]
    fn what_the_batch_gives_itself_is_refused_with_advice() {
        for (flags, said) in [
            ("-o x.ndf", "--extension"),
            ("-ox.ndf", "--extension"),
            ("--output=x.ndf", "--extension"),
            ("--json", "already"),
            ("--threads 3", "before `--`"),
            ("--resume c", "resumes the batch"),
            ("--checkpoint c", "of each"),
            ("--log l", "the same file"),
        ] {
            assert!(refused("fit", flags).contains(said), "{flags}");
        }
        // To `render`, paths are an input.
        let render = Recipe::named("render").unwrap();
        assert!(check(render, &words("--paths p.ply"), Some("png")).is_ok());
        assert!(refused("geodesic", "--source-vertex 0 --paths p.ply").contains("the same file"));
    }

    #[test]
    fn a_checkpoint_has_the_settings_that_it_began_with() {
        let fit = Recipe::named("fit").unwrap();
        let flags =
            words("--seed 3 --epochs 9 --time-limit 5 --as cloud --columns x,y,z --lossless --field network");
        let kept = beside_resume(fit, &flags);
        assert_eq!(kept, ["--as=cloud", "--columns=x", "--columns=y", "--columns=z", "--time-limit=5"]);
        let all = [&kept[..], &words("--resume c --checkpoint c")].concat();
        assert!(fit.command().try_get_matches_from(stand_in(fit, &all, Some("ndf"))).is_ok());
    }

    #[test]
    fn a_picture_is_read_as_its_item_was() {
        let (fit, render) = (Recipe::named("fit").unwrap(), Recipe::named("render").unwrap());
        let kept = shared_with(fit, &words("--as cloud --base-faces 300 --seed 2"), &render.command());
        assert_eq!(kept, ["--as=cloud", "--seed=2"]);
    }
}
