//! `sinew`: scenes, takes and sessions from the command line.

mod bridge;
mod connection;
#[cfg(feature = "embedded")]
mod demo;
mod drive;
mod edit;
#[cfg(feature = "embedded")]
mod embedded;
mod events;
mod explain;
mod inspect;
mod latency;
mod modules;
mod out;
mod percentiles;
mod progress;
mod record;
mod run;
mod sessions;
mod stream;
#[cfg(feature = "embedded")]
mod sweep;
mod table;
mod watch;

use std::{io, process::ExitCode};

use clap::{CommandFactory as _, Parser, Subcommand};
use clap_complete::Shell;

/// What stops a command: its text says what, why and what to do.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Ties meshes to motion: posts scenes, streams takes, watches the mesh that follows.
#[derive(Parser)]
#[command(
    name = "sinew",
    version,
    after_help = "Examples:
  sinew demo                          a walking figure, live, in this minute
  sinew run bridge.toml               runs a scene on a server inside this command
  sinew inspect walk.c3d              what a take or a mesh file holds

`sinew COMMAND --help` shows examples of each command."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[cfg(feature = "embedded")]
    Demo(demo::Arguments),
    Run(run::Arguments),
    Stream(stream::Arguments),
    Bridge(bridge::Arguments),
    Record(record::Record),
    Replay(record::Replay),
    #[cfg(feature = "embedded")]
    Sweep(sweep::Arguments),
    Watch(watch::Arguments),
    Sessions(sessions::Arguments),
    Inspect(inspect::Arguments),
    /// Prints a script that completes `sinew` in a shell.
    #[command(after_help = "Examples:
  sinew completions bash > ~/.local/share/bash-completion/completions/sinew
  sinew completions zsh > \"${fpath[1]}/_sinew\"
  sinew completions fish > ~/.config/fish/completions/sinew.fish")]
    Completions {
        /// The shell.
        shell: Shell,
    },
}

#[tokio::main]
async fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env()
                .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn")),
        )
        .with_ansi(io::IsTerminal::is_terminal(&io::stderr()))
        .with_writer(io::stderr)
        .init();
    let outcome = match Cli::parse().command {
        #[cfg(feature = "embedded")]
        Command::Demo(arguments) => demo::demo(arguments).await,
        Command::Run(arguments) => run::run(arguments).await,
        Command::Stream(arguments) => stream::stream(arguments).await,
        Command::Bridge(arguments) => bridge::bridge(arguments).await,
        Command::Record(arguments) => record::record(arguments).await,
        Command::Replay(arguments) => record::replay(arguments).await,
        #[cfg(feature = "embedded")]
        Command::Sweep(arguments) => sweep::sweep(arguments).await,
        Command::Watch(arguments) => watch::watch(arguments).await,
        Command::Sessions(arguments) => sessions::sessions(arguments).await,
        Command::Inspect(arguments) => inspect::inspect(&arguments),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "sinew", &mut script);
            let script = String::from_utf8_lossy(&script);
            out::write(format_args!("{script}")).map_err(Failure::from)
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) if out::reader_left(failure.as_ref()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("sinew: {failure}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_shows_examples() {
        for command in Cli::command().get_subcommands() {
            let help = command
                .get_after_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            assert!(
                help.contains("sinew "),
                "{} shows no example",
                command.get_name()
            );
        }
    }
}
