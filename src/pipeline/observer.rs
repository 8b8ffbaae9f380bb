//! Who is told how a run goes on.

/// Told of every stage as it begins, goes on and ends. The core says what happens; the command
/// line decides how that looks.
pub trait Observer: Sync {
    /// A stage begins; `total` where its steps can be counted.
    fn begin(&self, stage: &'static str, total: Option<usize>);
    /// A step of the stage is done. Called from many threads.
    fn step(&self);
    /// The stage ends, with what came of it.
    fn end(&self, result: &str);
}

/// Tells nobody.
#[derive(Debug, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {
    fn begin(&self, _stage: &'static str, _total: Option<usize>) {}
    fn step(&self) {}
    fn end(&self, _result: &str) {}
}
