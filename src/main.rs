//! The `bouncelight` program: parse the command line, run the subcommand, turn errors into exit codes.

fn main() -> std::process::ExitCode {
    bouncelight::cli::main()
}
