//! What `--json` prints, against `docs/json.schema.json`; and `docs/json.md`, which is made of it.
//!
//! [`check`] sees the output of every run in these tests. It knows the keywords that the schema uses, and refuses others.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::LazyLock;

use serde_json::{Map, Value};

use super::{Folder, ndf};

static SCHEMA: LazyLock<Value> =
    LazyLock::new(|| serde_json::from_str(include_str!("../../../docs/json.schema.json")).unwrap());

/// Parts that several commands have.
const PARTS: [&str; 10] = [
    "statuses",
    "point",
    "box",
    "bytes",
    "distances",
    "metric",
    "fitted",
    "heat-method",
    "shortest-path",
    "scalar-range",
];

/// Commands, where `scalars` is followed by what it does.
const COMMANDS: [&str; 28] = [
    "batch",
    "centre",
    "completions",
    "convert",
    "decimate",
    "demo",
    "directions",
    "extract",
    "fit",
    "geodesic",
    "heat",
    "info",
    "laplacian",
    "logmap",
    "man",
    "measure",
    "mesh",
    "path",
    "remesh",
    "render",
    "repair",
    "sample",
    "scalars",
    "signed-distance",
    "spectrum",
    "stripes",
    "transport",
    "view",
];

/// Whether the object that a command printed is as the schema says.
pub(super) fn check(arguments: &[&str], printed: &Value) {
    let command = arguments.iter().position(|word| COMMANDS.contains(word)).unwrap();
    let name = match (arguments[command], printed["kind"].as_str()) {
        ("batch", _) if ["merge", "report"].contains(&arguments[command + 1]) => {
            format!("batch-{}", arguments[command + 1])
        }
        ("scalars", _) => format!("scalars-{}", arguments[command + 1]),
        ("info", Some("oriented-cloud" | "cloud")) => "info-cloud".to_owned(),
        ("info", Some("neural-sdf" | "neus" | "nerf")) => "info-network".to_owned(),
        ("info", Some(kind)) => format!("info-{kind}"),
        (command, _) => command.to_owned(),
    };
    let wrong = differences(&SCHEMA["$defs"][&name], printed, &name);
    assert!(wrong.is_empty(), "{arguments:?}: {}", wrong.join("; "));
}

/// Whether a row of a batch is as the schema says, and its result as that of the command.
pub(super) fn check_row(command: &str, row: &Value) {
    let wrong = differences(&SCHEMA["$defs"]["batch-row"], row, "row");
    assert!(wrong.is_empty(), "{}", wrong.join("; "));
    if row["status"] == "ok" {
        check(&[command], &row["result"]);
    }
}

/// Where a value is not as its schema says.
fn differences(schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let Some(keywords) = schema.as_object() else { return vec![format!("{at} is not in the schema")] };
    let mut wrong = Vec::new();
    let mut must = |holds: bool, what: &str| {
        if !holds {
            wrong.push(format!("{at} is {value}, not {what}"));
        }
    };
    for (keyword, said) in keywords {
        match keyword.as_str() {
            "type" => {
                let names = said.as_array().map_or_else(|| std::slice::from_ref(said), Vec::as_slice);
                must(names.iter().any(|name| is_of(name.as_str().unwrap(), value)), &said.to_string());
            }
            "enum" => must(said.as_array().unwrap().contains(value), &said.to_string()),
            "const" => must(said == value, &said.to_string()),
            "minItems" => {
                must(value.as_array().is_none_or(|a| a.len() as u64 >= said.as_u64().unwrap()), "longer");
            }
            "maxItems" => {
                must(value.as_array().is_none_or(|a| a.len() as u64 <= said.as_u64().unwrap()), "shorter");
            }
            "anyOf" => {
                let fits = |schema: &Value| differences(schema, value, at).is_empty();
                must(said.as_array().unwrap().iter().any(fits), &said.to_string());
            }
            "required" => {
                let is_there = |key: &Value| value.get(key.as_str().unwrap()).is_some();
                let missing = said.as_array().unwrap().iter().find(|key| value.is_object() && !is_there(key));
                must(missing.is_none(), &format!("an object with {missing:?}"));
            }
            "$ref" | "properties" | "items" | "additionalProperties" | "description" | "unit" => {}
            other => panic!("the schema of {at} has the keyword {other}, which is not checked here"),
        }
    }
    if let Some(name) = keywords.get("$ref") {
        wrong.extend(differences(resolved(name), value, at));
    }
    let known = keywords.get("properties").and_then(Value::as_object);
    for (key, value) in value.as_object().into_iter().flatten() {
        match known.map(|known| known.get(key)) {
            Some(Some(schema)) => wrong.extend(differences(schema, value, &format!("{at}.{key}"))),
            Some(None) => wrong.push(format!("{at}.{key} is not in the schema")),
            None => {}
        }
    }
    if let Some(schema) = keywords.get("items") {
        for (k, item) in value.as_array().into_iter().flatten().enumerate() {
            wrong.extend(differences(schema, item, &format!("{at}[{k}]")));
        }
    }
    wrong
}

fn resolved(reference: &Value) -> &'static Value {
    &SCHEMA["$defs"][reference.as_str().unwrap().strip_prefix("#/$defs/").unwrap()]
}

fn is_of(name: &str, value: &Value) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("the schema has the type {other}"),
    }
}

/// Every number has a unit, and every object says all its keys.
#[test]
fn the_schema_leaves_nothing_open() {
    fn visit(schema: &Map<String, Value>, at: &str) {
        let types: Vec<&str> = match &schema.get("type") {
            Some(Value::String(name)) => vec![name],
            Some(Value::Array(names)) => names.iter().map(|n| n.as_str().unwrap()).collect(),
            _ => Vec::new(),
        };
        if types.iter().any(|name| ["number", "integer"].contains(name)) {
            assert!(schema.contains_key("unit") || at.ends_with("[]"), "{at} has no unit");
        }
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            assert_eq!(schema["additionalProperties"], false, "{at}");
            for (key, schema) in properties {
                let schema = schema.as_object().unwrap();
                assert!(schema.contains_key("description"), "{at}.{key} is not described");
                visit(schema, &format!("{at}.{key}"));
            }
        }
        if let Some(items) = schema.get("items").and_then(Value::as_object) {
            let numbers = ["number", "integer"].map(Value::from);
            let is_of_numbers = items.get("type").is_some_and(|name| numbers.contains(name));
            let has_unit = schema.contains_key("unit") || items.contains_key("unit");
            assert!(!is_of_numbers || has_unit, "{at} has no unit");
            visit(items, &format!("{at}[]"));
        }
    }
    for (name, schema) in SCHEMA["$defs"].as_object().unwrap() {
        visit(schema.as_object().unwrap(), name);
    }
}

/// What has no number is null, as the schema says.
#[test]
fn defective_and_empty_files_are_described_as_the_schema_says() {
    let folder = Folder::new("json-defects");
    folder.write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n");
    folder.write("point.obj", "v 0 0 0\n");
    folder.write("empty.obj", "# nothing\n");
    for file in ["nan.obj", "point.obj", "empty.obj"] {
        let run = ndf(&folder.0, &["info", file, "--json"]);
        if run.code == 0 {
            run.json();
        }
    }
}

#[test]
fn the_demo_is_described() {
    let folder = Folder::new("json-demo");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "a.ply", "--json"]).json();
    let quick = ["--field", "network", "--epochs", "40", "--samples", "256"];
    ndf(&folder.0, &[&["demo", "a.ply", "--quiet", "--json"], &quick[..]].concat()).json();
}

/// The page is what this makes of the schema. `NDF_WRITE_DOCS=1 cargo test -p ndf-cli json` writes it again.
#[test]
fn the_page_is_made_of_the_schema() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/json.md");
    let page = page();
    if std::env::var_os("NDF_WRITE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    assert!(std::fs::read_to_string(&path).unwrap() == page, "docs/json.md is not what the schema says");
}

fn page() -> String {
    let mut page = include_str!("json.md").to_owned();
    for (name, schema) in SCHEMA["$defs"].as_object().unwrap() {
        if PARTS.contains(&name.as_str()) {
            continue;
        }
        let title = schema["description"].as_str().unwrap();
        write!(page, "\n## {title}\n\n| key | type | unit | what it is |\n|---|---|---|---|\n").unwrap();
        rows(&mut page, schema, "");
    }
    page
}

/// A row for every key, below it those of the object that it has.
fn rows(page: &mut String, schema: &'static Value, at: &str) {
    for (key, schema) in schema["properties"].as_object().into_iter().flatten() {
        let key = format!("{at}{key}");
        let inner = schema.get("$ref").map_or(schema, resolved);
        let (array, element) = match inner.get("items") {
            Some(items) => ("[]", items.get("$ref").map_or(items, resolved)),
            None => ("", inner),
        };
        let types: Vec<&str> = match (&inner["type"], &inner["anyOf"][0]["$ref"]) {
            (Value::String(name), _) => vec![name],
            (Value::Array(names), _) => names.iter().map(|n| n.as_str().unwrap()).collect(),
            (_, reference) => {
                let mut all = vec![resolved(reference)["type"].as_str().unwrap()];
                all.push("null");
                all
            }
        };
        let unit = [inner, element].into_iter().find_map(|s| s["unit"].as_str()).unwrap_or("");
        let description = schema["description"].as_str().unwrap();
        let one_of = inner["enum"].as_array().map_or_else(String::new, |values| {
            format!(
                ": {}",
                values.iter().map(|v| format!("`{}`", v.as_str().unwrap())).collect::<Vec<_>>().join(", ")
            )
        });
        writeln!(page, "| `{key}` | {} | {unit} | {description}{one_of} |", types.join(" or ")).unwrap();
        let below = inner["anyOf"].get(0).map_or(element, |first| resolved(&first["$ref"]));
        rows(page, below, &format!("{key}{array}."));
    }
}
