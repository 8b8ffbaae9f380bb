//! The book says what the program does: every key, every subcommand, every reason.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;
use std::process::Command;

use rockmap::input::Reason;
use rockmap::pipeline::{Config, Overrides};
use serde_json::Value;

fn page(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("docs/src")
        .join(name);
    fs::read_to_string(path).unwrap()
}

#[test]
fn every_key_of_the_pipeline_file_is_documented() {
    let text = "[input]\nposes = \"p.csv\"\ndetections = \"d.csv\"\n";
    let config = Config::parse(text, Path::new("p.toml"), &Overrides::default()).unwrap();
    let config = serde_json::to_value(config).unwrap();
    let page = page("pipeline-file.md");
    let sections = config.as_object().unwrap();
    let mut keys: Vec<&str> = vec!["dir", "lat_deg", "lon_deg", "height_m"];
    for (section, values) in sections {
        assert!(page.contains(&format!("[{section}]")), "[{section}]");
        keys.extend(values.as_object().unwrap().keys().map(String::as_str));
    }
    assert!(keys.len() > 25, "{keys:?}");
    let missing: Vec<&str> = keys.into_iter().filter(|k| !page.contains(k)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_pipeline_shipped_has_only_known_keys() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        Config::read(&entry.unwrap().path(), &Overrides::default()).unwrap();
        count += 1;
    }
    assert!(count >= 6);
}

#[test]
fn every_subcommand_and_option_is_documented() {
    let page = page("command-line.md");
    let help = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_rockmap"))
            .args(arguments)
            .output()
            .unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let commands: Vec<String> = help(&["--help"])
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        // Deeper ones are wrapped descriptions.
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next().map(str::to_owned))
        .filter(|name| name != "help")
        .collect();
    assert!(
        commands.contains(&"bench-accuracy".to_owned()),
        "{commands:?}"
    );
    for command in &commands {
        assert!(page.contains(&format!("## rockmap {command}")), "{command}");
    }
    let mut paths: Vec<Vec<&str>> = commands.iter().map(|c| vec![c.as_str()]).collect();
    for question in ["rays", "pixels", "list"] {
        assert!(page.contains(&format!("`rockmap camera {question} FILE`")));
        paths.push(vec!["camera", question]);
    }
    for command in &paths {
        let arguments: Vec<&str> = command.iter().copied().chain(["--help"]).collect();
        for word in help(&arguments).split_whitespace() {
            if let Some(option) = word.strip_prefix("--")
                && option.len() > 2
                && option != "help"
            {
                assert!(
                    page.contains(&format!("--{option}")),
                    "{command:?} --{option}"
                );
            }
        }
    }
}

#[test]
fn every_reason_of_a_reject_is_documented() {
    let page = page("rejects.md");
    let reasons = [
        Reason::BadValue,
        Reason::Duplicate,
        Reason::OffSite,
        Reason::NoPose,
        Reason::PoseGap,
        Reason::UnknownCamera,
        Reason::PictureSize,
        Reason::UnknownImage,
        Reason::ImageRejected,
        Reason::OutsidePicture,
        Reason::LowScore,
        Reason::OutsideLens,
        Reason::AboveHorizon,
        Reason::TooNear,
        Reason::TooFar,
        Reason::OffTerrain,
        Reason::UnderGround,
        Reason::RangeTooShort,
    ];
    for reason in reasons {
        assert!(page.contains(&format!("`{reason}`")), "{reason}");
        assert_eq!(
            serde_json::to_value(reason).unwrap(),
            Value::from(reason.as_str())
        );
    }
}
