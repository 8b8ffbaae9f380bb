use rockmap::experiment::{circle::*, circle_figures::*, field::*};
fn main() {
    let c = |noise, n_views| Circle { n_objects: 12, n_views, noise };
    std::fs::create_dir_all("/tmp/rep").unwrap();
    let seed = 2005;
    let cols: Vec<_> = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3].map(|n| Column::new(c(n, 4), 50, seed)).into();
    let seven: Vec<_> = (1..6).map(|v| Column::new(c(0.15, v), 50, seed)).collect();
    std::fs::write("/tmp/rep/figure-5.svg", figure_5(&c(0.15, 4).trial(seed, 0), 0.15)).unwrap();
    std::fs::write("/tmp/rep/figure-6.svg", figure_6(&cols)).unwrap();
    std::fs::write("/tmp/rep/figure-7.svg", figure_7(&seven)).unwrap();
    let t = std::time::Instant::now();
    let f = Field::play(std::path::Path::new("/tmp/rep/field")).unwrap();
    println!("{:?} {:?}", f.counts().unwrap(), t.elapsed());
    std::fs::write("/tmp/rep/figure-8.svg", f.map()).unwrap();
    for (n, p) in [(9, f.picture(0).unwrap()), (10, f.picture(1).unwrap()), (11, f.single_view_picture().unwrap()), (12, f.fused_picture().unwrap())] {
        p.write(std::path::Path::new(&format!("/tmp/rep/figure-{n}.jpg")), 80).unwrap();
    }
    println!("{:?}", t.elapsed());
}
