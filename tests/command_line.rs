//! The command line as scripts, shells and editors meet it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rockmap(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rockmap"));
    command.args(arguments).current_dir(root());
    for variable in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(variable);
    }
    command.envs(environment.iter().copied());
    command.output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

const COMMANDS: [&str; 11] = [
    "run",
    "project",
    "check",
    "simulate",
    "evaluate",
    "compare",
    "reproduce",
    "bench-accuracy",
    "completions",
    "man",
    "schema",
];

#[test]
fn every_command_shows_examples() {
    for command in COMMANDS {
        let help = text(&rockmap(&[command, "--help"], &[]).stdout);
        let (_, examples) = help.split_once("Examples:").unwrap();
        assert!(
            examples.contains(&format!("rockmap {command}")),
            "{command}"
        );
    }
}

#[test]
fn a_mistyped_command_or_option_is_told_what_was_meant() {
    let output = rockmap(&["evalute"], &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("some similar subcommands exist: 'simulate', 'evaluate'")
    );
    let output = rockmap(&["run", "p.toml", "--thread", "2"], &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("a similar argument exists: '--threads'"));
    let set = "view.max_rnge_m=3";
    let output = rockmap(&["check", "fixtures/tiny/pipeline.toml", "--set", set], &[]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        text(&output.stderr),
        "error: --set: view.max_rnge_m: unknown key, is max_range_m meant?\n"
    );
}

#[test]
fn errors_are_coloured_only_where_that_is_wanted() {
    let stderr = |environment: &[(&str, &str)]| {
        text(&rockmap(&["check", "no-such.toml"], environment).stderr)
    };
    let plain = "error: no-such.toml: cannot read: no such file or folder\n";
    assert_eq!(stderr(&[]), plain);
    let coloured = stderr(&[("CLICOLOR_FORCE", "1")]);
    assert!(coloured.starts_with("\u{1b}["), "{coloured:?}");
    assert_eq!(stderr(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), plain);
}

#[test]
fn completions_name_every_command() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = rockmap(&["completions", shell], &[]);
        assert_eq!(output.status.code(), Some(0));
        let script = text(&output.stdout);
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
}

#[test]
fn manual_pages_are_written_for_every_command() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("man1");
    let output = rockmap(&["man", "--to", folder.to_str().unwrap()], &[]);
    assert_eq!(output.status.code(), Some(0));
    for command in COMMANDS {
        let page = fs::read_to_string(folder.join(format!("rockmap-{command}.1"))).unwrap();
        assert!(page.contains(".SH OPTIONS"), "{command}");
    }
    let page = fs::read_to_string(folder.join("rockmap.1")).unwrap();
    assert_eq!(page, text(&rockmap(&["man"], &[]).stdout));
}

#[test]
fn summaries_and_faults_are_there_for_scripts() {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("map");
    let out = out.to_str().unwrap();
    let pipeline = "fixtures/tiny/pipeline.toml";
    let output = rockmap(&["run", pipeline, "--out", out, "--json", "--quiet"], &[]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rocks = fs::read(Path::new(out).join("rocks.geojson")).unwrap();
    let rocks: Value = serde_json::from_slice(&rocks).unwrap();
    let n_rocks = rocks["features"].as_array().unwrap().len();
    assert_eq!(summary["n_objects"], json!(n_rocks));
    assert_eq!(summary["too_many_rejects"], json!(false));

    let output = rockmap(&["check", pipeline, "--json"], &[]);
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["n_objects"], Value::Null);
    assert!(summary["n_views"].as_u64().unwrap() > 0);

    let output = rockmap(&["check", pipeline, "--json", "--set", "view.aim=top"], &[]);
    assert_eq!(output.status.code(), Some(2));
    let faults: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        faults["faults"],
        json!([{
            "file": "--set",
            "line": null,
            "column": null,
            "field": "view.aim",
            "problem": "found \"top\", expected one of center, bottom",
        }])
    );
}

#[test]
fn the_schema_takes_every_pipeline_and_refuses_what_the_reader_refuses() {
    let output = rockmap(&["schema"], &[]);
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        schema["$schema"],
        json!("https://json-schema.org/draft/2020-12/schema")
    );
    let parsed = |text: &str| toml_edit::de::from_str::<Value>(text).unwrap();
    let shipped = fs::read_dir(root().join("pipelines")).unwrap();
    let shipped = shipped.map(|entry| entry.unwrap().path());
    let fixtures = ["tiny", "panorama", "mast-camera"]
        .map(|name| root().join("fixtures").join(name).join("pipeline.toml"));
    let mut count = 0;
    for path in shipped.chain(fixtures) {
        let pipeline = parsed(&fs::read_to_string(&path).unwrap());
        assert_eq!(
            problems(&pipeline, &schema, ""),
            [""; 0],
            "{}",
            path.display()
        );
        count += 1;
    }
    assert!(count >= 9);
    let input = "[input]\nposes = \"p.csv\"\ndetections = [\"d.csv\", \"e.csv\"]\n";
    let wrong = [
        ("[view]\nmax_range = 3\n", "view.max_range: unknown"),
        ("[view]\nmax_range_m = 0\n", "view.max_range_m: too small"),
        ("[view]\nmin_score = 1.5\n", "view.min_score: too large"),
        ("[view]\naim = \"top\"\n", "view.aim: no alternative fits"),
        (
            "[output]\nannotate = 1\n",
            "output.annotate: not of type boolean",
        ),
        (
            "[fusion]\nmethod = \"k-means\"\n",
            "fusion.method: not in the list",
        ),
        (
            "[output]\nformats = [\"shp\"]\n",
            "output.formats: no alternative fits",
        ),
        (
            "[site]\norigin = { lat_deg = 1 }\n",
            "site.origin.lon_deg: missing",
        ),
    ];
    for (section, problem) in wrong {
        let pipeline = parsed(&format!("{input}{section}"));
        assert_eq!(problems(&pipeline, &schema, ""), [problem]);
    }
    assert_eq!(problems(&parsed(""), &schema, ""), ["input: missing"]);
}

/// What is wrong with a value by a schema, for the words of JSON Schema that the schema uses; any
/// other is a failure, so that nothing goes unchecked.
fn problems(value: &Value, schema: &Value, path: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut problem = |what: &str| found.push(format!("{path}: {what}"));
    let mut below = Vec::new();
    for (word, rule) in schema.as_object().unwrap() {
        let number = |bad: fn(f64, f64) -> bool| {
            let (value, bound) = (value.as_f64(), rule.as_f64().unwrap());
            value.is_some_and(|value| bad(value, bound))
        };
        match word.as_str() {
            "$schema" | "title" | "description" | "default" | "examples" => {}
            "type" => {
                let is_it = match rule.as_str().unwrap() {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "number" => value.is_number(),
                    "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
                    other => panic!("type {other}"),
                };
                if !is_it {
                    problem(&format!("not of type {}", rule.as_str().unwrap()));
                }
            }
            "enum" if !rule.as_array().unwrap().contains(value) => problem("not in the list"),
            "anyOf" => {
                let mut any = rule.as_array().unwrap().iter();
                if !any.any(|schema| problems(value, schema, path).is_empty()) {
                    problem("no alternative fits");
                }
            }
            "minimum" if number(|x, bound| x < bound) => problem("too small"),
            "exclusiveMinimum" if number(|x, bound| x <= bound) => problem("too small"),
            "maximum" if number(|x, bound| x > bound) => problem("too large"),
            "enum" | "minimum" | "exclusiveMinimum" | "maximum" => {}
            "items" => {
                let items = value.as_array().into_iter().flatten();
                below.extend(items.flat_map(|item| problems(item, rule, path)));
            }
            "properties" => {
                for (key, value) in value.as_object().into_iter().flatten() {
                    let path = format!("{path}.{key}");
                    let path = path.trim_start_matches('.');
                    match rule.get(key) {
                        Some(schema) => below.extend(problems(value, schema, path)),
                        None => below.push(format!("{path}: unknown")),
                    }
                }
            }
            "additionalProperties" => assert_eq!(rule, &json!(false)),
            "required" => {
                for key in rule.as_array().unwrap() {
                    let key = key.as_str().unwrap();
                    if value.get(key).is_none() {
                        let path = format!("{path}.{key}");
                        below.push(format!("{}: missing", path.trim_start_matches('.')));
                    }
                }
            }
            other => panic!("the word {other}"),
        }
    }
    found.extend(below);
    found
}
