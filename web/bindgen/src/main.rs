//! Writes the JavaScript and the types beside a WebAssembly file that `wasm-bindgen` annotated.

use std::env::args_os;
use std::path::PathBuf;
use std::process::ExitCode;

use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = args_os().skip(1).map(PathBuf::from).collect();
    let [input, output] = &arguments[..] else {
        eprintln!("usage: ndf-bindgen FILE.wasm FOLDER");
        return ExitCode::from(2);
    };
    let mut bindgen = Bindgen::new();
    let written = bindgen.input_path(input).web(true).and_then(|bindgen| {
        bindgen.typescript(true).omit_default_module_path(true).remove_name_section(true);
        bindgen.remove_producers_section(true).generate(output)
    });
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ndf-bindgen: {error:?}");
            ExitCode::FAILURE
        }
    }
}
