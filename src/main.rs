//! The `lamella` program: hands the arguments to the commands and their result to the shell.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
