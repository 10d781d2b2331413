//! Standard input and output in place of files, completions and manual pages.

use std::io::Write;
use std::process::{Command, Output, Stdio};

use super::{Folder, ndf};

/// Runs the program with this on its standard input.
fn fed(folder: &Folder, arguments: &[&str], input: &[u8]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_ndf"));
    program.current_dir(&folder.0).args(arguments).env("TMPDIR", folder.0.join("tmp"));
    let mut child =
        program.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // A program that fails early does not read all of it.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

#[test]
fn streams_stand_for_files() {
    let folder = Folder::new("streams");
    std::fs::create_dir(folder.0.join("tmp")).unwrap();
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]).json();
    let torus = std::fs::read(folder.0.join("torus.ply")).unwrap();
    let geodesic = |input, output| ["geodesic", input, "-o", output, "--source-vertex", "7"];
    assert_eq!(ndf(&folder.0, &geodesic("torus.ply", "d.ply")).code, 0);
    let piped = fed(&folder, &geodesic("-", "-"), &torus);
    assert!(piped.stdout == std::fs::read(folder.0.join("d.ply")).unwrap());
    let said = String::from_utf8(piped.stderr).unwrap();
    assert!(piped.status.success() && said.contains("standard output: distances"), "{said}");
    let info = fed(&folder, &["info", "-"], &torus);
    assert!(String::from_utf8(info.stdout).unwrap().starts_with("standard input: mesh (PLY)"));
    let failing: [(&[&str], &[u8], i32, &str); 7] = [
        (&["info", "-"], b"junk", 1, "ndf: standard input"),
        (&["info", "-"], b"", 2, "nothing came"),
        (&["measure", "-", "-"], &torus, 2, "read once"),
        (&[&geodesic("-", "-")[..], &["--json"]].concat(), &torus, 2, "-o -"),
        (&[&geodesic("-", "-")[..], &["--path-to", "1,0,0"]].concat(), &torus, 1, "--paths"),
        (&["view", "-", "-o", "-", "--open"], &torus, 1, "--open"),
        (
            &["geodesic", "-", "-o", "-", "--source-vertex", "99999"],
            &torus,
            1,
            "standard input has no vertex",
        ),
    ];
    for (arguments, input, code, what) in failing {
        let run = fed(&folder, arguments, input);
        let said = String::from_utf8(run.stderr).unwrap();
        assert_eq!((run.status.code(), run.stdout.len()), (Some(code), 0), "{arguments:?}: {said}");
        assert!(said.contains(what), "{arguments:?}: {said}");
    }
    // Nothing temporary is left.
    assert_eq!(std::fs::read_dir(folder.0.join("tmp")).unwrap().count(), 0);
}

#[test]
fn models_and_pictures_go_through_streams() {
    let folder = Folder::new("stream-models");
    std::fs::create_dir(folder.0.join("tmp")).unwrap();
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]).json();
    let torus = std::fs::read(folder.0.join("torus.ply")).unwrap();
    let quick = ["--size", "1000", "--base-faces", "100", "--quiet"];
    // Models hold the name of what they were learned from.
    folder.write("standard input", &torus);
    assert_eq!(ndf(&folder.0, &[&["fit", "standard input", "-o", "m.ndf"], &quick[..]].concat()).code, 0);
    let model = fed(&folder, &[&["fit", "-", "-o", "-"], &quick[..]].concat(), &torus).stdout;
    assert!(model == std::fs::read(folder.0.join("m.ndf")).unwrap());
    assert_eq!(ndf(&folder.0, &["extract", "m.ndf", "-o", "m.ply"]).code, 0);
    let mesh = fed(&folder, &["extract", "-", "-o", "-"], &model).stdout;
    assert!(mesh == std::fs::read(folder.0.join("m.ply")).unwrap());
    let picture = fed(&folder, &["render", "-", "-o", "-", "--size", "32,32"], &mesh).stdout;
    assert_eq!(&picture[1..4], b"PNG");
    assert_eq!(std::fs::read_dir(folder.0.join("tmp")).unwrap().count(), 0);
}

#[test]
fn every_command_has_a_manual_page_and_shells_complete_them() {
    let folder = Folder::new("manual");
    let found = ndf(&folder.0, &["man", "pages", "--json"]).json();
    for page in ["ndf.1", "ndf-fit.1", "ndf-scalars-eval.1", "ndf-batch-decimate.1"] {
        assert!(found["pages"].as_array().unwrap().iter().any(|p| p == page), "{page}");
        let text = std::fs::read_to_string(folder.0.join("pages").join(page)).unwrap();
        assert!(text.contains(".SH SYNOPSIS"), "{text}");
    }
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = ndf(&folder.0, &["completions", shell]).stdout;
        assert!(script.contains("geodesic") && script.contains("relative-edge-length"), "{shell}");
    }
    ndf(&folder.0, &["completions", "bash", "--json"]).json();
}
