use std::collections::BTreeMap;
use std::fs;

use super::*;
use crate::pipeline::Silent;

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    found
}

fn made(threads: usize) -> (Reproduction, BTreeMap<PathBuf, Vec<u8>>) {
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("figures");
    let options = ReproduceOptions {
        n_trials: 6,
        ..ReproduceOptions::new(out.clone())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().unwrap();
    let reproduction = pool.install(|| reproduce(&options, &Silent)).unwrap();
    // Another run with the same options replaces them, one with others does not.
    let others = ReproduceOptions { seed: 1, ..options };
    let refused = reproduce(&others, &Silent).unwrap_err().to_string();
    assert!(refused.contains("the outputs of another run"), "{refused}");
    let strip = |path: &Path| path.strip_prefix(&out).unwrap().to_owned();
    let files = files(&out).into_iter();
    (reproduction, files.map(|(p, c)| (strip(&p), c)).collect())
}

#[test]
fn figures_are_the_same_at_any_number_of_threads() {
    let (first, files) = made(1);
    let (second, again) = made(2);
    assert_eq!(first, second);
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&files), names(&again));
    for (name, content) in &files {
        assert!(again[name] == *content, "{} differs", name.display());
    }
    for figure in 5..=8 {
        assert!(files.contains_key(Path::new(&format!("figure-{figure}.svg"))));
        assert!(files.contains_key(Path::new(&format!("figure-{figure}.csv"))));
    }
    for figure in 9..=12 {
        assert!(files.contains_key(Path::new(&format!("figure-{figure}.jpg"))));
    }
    let field = &first.field;
    for by in &field.fused {
        assert!(field.single.correct < by.found.correct && by.found.correct <= field.n_rocks);
    }
    assert_eq!(first.by_noise.len(), NOISES.len() * 5);
    assert!(first.to_string().contains("Figure 7"));
}
