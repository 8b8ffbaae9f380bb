use rockmap::experiment::{circle::*, circle_figures::*};
fn main() {
    let c = |noise, n_views| Circle { n_objects: 12, n_views, noise };
    std::fs::create_dir_all("/tmp/rep").unwrap();
    for seed in [2005u64, 1, 2, 3] {
    let cols: Vec<_> = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3].map(|n| Column::new(c(n, 4), 50, seed)).into();
    for r in cols.iter().flat_map(Column::rows) { println!("{seed} {} {} {:.4} {:.4} {:?}", r.noise, r.method, r.error.mean, r.error.standard_error.unwrap(), r.against_em.map(|t| t.wins)); }
    let seven: Vec<_> = (1..6).map(|v| Column::new(c(0.15, v), 50, seed)).collect();
    if seed == 2005 {
    for r in seven.iter().flat_map(Column::rows) { println!("{seed} {} {} {:.4} med {:.4} ", r.n_views, r.method, r.error.mean, r.spread.median); }
    std::fs::write("/tmp/rep/figure-5.svg", figure_5(&c(0.15, 4).trial(seed, 0), 0.15)).unwrap();
    std::fs::write("/tmp/rep/figure-6.svg", figure_6(&cols)).unwrap();
    std::fs::write("/tmp/rep/figure-7.svg", figure_7(&seven)).unwrap(); }
    }
}
