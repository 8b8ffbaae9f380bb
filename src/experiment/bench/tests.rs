use super::*;
use crate::pipeline::Silent;

const SCENE: &str = "seed = 0\n[rocks]\nnumber = 40\n\
    area = { west_m = 4.0, east_m = 12.0, south_m = -3.0, north_m = 3.0 }\n\
    [platforms.rover]\nstations = 3\nspacing_m = 1.0\npans_deg = [0.0]\n";

fn options(home: &Path, seeds: RangeInclusive<u64>) -> BenchOptions {
    let scene = home.join("small.toml");
    std::fs::write(&scene, SCENE).unwrap();
    BenchOptions {
        scenes: vec![scene],
        seeds,
        contenders: Contender::all(),
        set: Vec::new(),
        scoring: evaluate::Options::default(),
        out: home.join("bench"),
    }
}

fn results(home: &Path) -> Vec<PathBuf> {
    let folder = home.join("bench/results");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths
}

#[test]
fn a_bench_goes_on_where_it_stopped() {
    let home = tempfile::tempdir().unwrap();
    bench_accuracy(&options(home.path(), 5..=6), &Silent).unwrap();
    let first = results(home.path());
    assert_eq!(first.len(), 2 * Contender::all().len());
    // A result with another number in it shows whether it is taken or computed again.
    let text = std::fs::read_to_string(&first[0]).unwrap();
    let mut scores: Scores = serde_json::from_str(&text).unwrap();
    assert!(scores.gospa_m > 0.0 && scores.gospa_m < 5.0 && scores.n_truths > 10);
    scores.gospa_m = 1000.0;
    std::fs::write(&first[0], serde_json::to_string(&scores).unwrap()).unwrap();
    // One broken off in the middle of a word is computed again.
    std::fs::write(&first[1], &text[..text.len() / 2]).unwrap();
    let table = bench_accuracy(&options(home.path(), 5..=7), &Silent).unwrap();
    assert_eq!(results(home.path()).len(), 3 * Contender::all().len());
    // Files stand by name, rows by contender: `clairvoyant` is the first file and the third row.
    assert!(table.rows[2].mean("gospa_m").unwrap().mean > 300.0);
    assert!(table.rows[0].mean("gospa_m").unwrap().mean < 5.0);
    assert_eq!(table.rows[0].n_seeds, 3);
    // Another scoring, settings or scene is another result.
    let mut other = options(home.path(), 5..=5);
    other.scoring.cutoff_m = 0.4;
    let table = bench_accuracy(&other, &Silent).unwrap();
    assert!(table.rows[0].mean("gospa_m").unwrap().mean < 5.0);
    other.set = vec!["fusion.width_m=0.3".to_owned()];
    bench_accuracy(&other, &Silent).unwrap();
    assert_eq!(results(home.path()).len(), 5 * Contender::all().len());
    let left: Vec<_> = std::fs::read_dir(home.path().join("bench"))
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert_eq!(left.len(), 3, "{left:?}");
}

#[test]
fn tables_are_the_same_at_any_number_of_threads() {
    let table = |threads| {
        let home = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let options = options(home.path(), 1..=4);
        let pool = pool.build().unwrap();
        let table = pool.install(|| bench_accuracy(&options, &Silent)).unwrap();
        let written = std::fs::read_to_string(home.path().join("bench/accuracy.md")).unwrap();
        assert_eq!(written, table.to_markdown());
        (written, table.to_csv())
    };
    let one = table(1);
    assert_eq!(one, table(2));
    assert_eq!(one.0.lines().count(), 2 + Contender::all().len());
}

#[test]
fn tables_by_hand() {
    let scores = |gospa_m, rmse_m| Scores {
        n_truths: 10,
        n_estimates: 8,
        gospa_m,
        f1: Some(0.5),
        rmse_m,
        n_missed: 3,
        n_false: 1,
        nees_per_dof: None,
        coverage_95: Some(1.0),
        seconds: 9.0,
    };
    let both = [scores(1.0, None), scores(2.0, Some(0.25))];
    let table = BenchTable {
        rows: vec![BenchRow::of("a", Contender::Method(Method::Em), &both)],
    };
    assert_eq!(
        table.to_markdown(),
        "| scene | method | seeds | GOSPA (m) | F1 | RMSE (m) | missed | false | NEES/2 | coverage \
         | rocks |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n\
         | a | em | 2 | 1.50 ± 0.50 | 0.500 ± 0.000 | 0.2500 | 3.0 ± 0.0 | 1.0 ± 0.0 | - \
         | 1.000 ± 0.000 | 10 ± 0 |\n"
    );
    assert!(
        table
            .to_csv()
            .contains("\na,em,2,1.500000,0.500000,0.500000,0.000000,0.250000,,")
    );
}

#[test]
fn options_are_told_what_is_wrong_with_them() {
    let said = |result: Result<RangeInclusive<u64>, Error>| result.unwrap_err().to_string();
    assert_eq!(parse_seeds("3..5").unwrap(), 3..=5);
    assert_eq!(parse_seeds("7").unwrap(), 7..=7);
    assert_eq!(
        said(parse_seeds("5..3")),
        "--seeds: found \"5..3\", expected A..B, whole numbers, A not above B"
    );
    let both = [Method::Em, Method::Paper].map(Contender::Method);
    assert_eq!(Contender::parse_list("em, paper").unwrap(), both);
    assert_eq!(
        Contender::parse_list("em,papr").unwrap_err().to_string(),
        "--methods: found \"papr\", expected a list of em, paper, belief, clairvoyant, fair (is paper meant?)"
    );
    assert_eq!(
        Contender::parse_list("em,em").unwrap_err().to_string(),
        "--methods: found em again, expected it once"
    );
    let home = tempfile::tempdir().unwrap();
    let mut twice = options(home.path(), 1..=1);
    twice.scenes.push(twice.scenes[0].clone());
    let said = bench_accuracy(&twice, &Silent).unwrap_err().to_string();
    assert!(
        said.ends_with("small.toml: found a second scene named small, expected names that differ"),
        "{said}"
    );
}
