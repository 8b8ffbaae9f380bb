//! The `rockmap` program.

fn main() -> std::process::ExitCode {
    rockmap::cli::main()
}
