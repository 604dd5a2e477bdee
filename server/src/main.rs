//! `sinew-server`: the service by itself.

use std::{
    io::{IsTerminal as _, Write as _},
    net::SocketAddr,
    path::PathBuf,
    process::ExitCode,
};

use clap::{Parser, ValueEnum};
use serde::Serialize;
use sinew_server::{Config, Server, Stopped};
use tracing_subscriber::EnvFilter;

/// Serves Sinew sessions: gRPC, grpc-web, the Rerun feed and the page on one port.
///
/// Settings come from the defaults, then the file, then the environment (SINEW_LISTEN,
/// SINEW_RECORDINGS, SINEW_MAX_SESSIONS, …), then these flags.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES)]
struct Flags {
    /// TOML file with settings.
    #[arg(long, env = "SINEW_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the settings as they came out, and stop.
    #[arg(long)]
    check_config: bool,
    /// What to log, such as `info` or `sinew_server=debug`.
    #[arg(long, env = "SINEW_LOG", default_value = "info", value_name = "FILTER")]
    log: String,
    /// How to log.
    #[arg(long, env = "SINEW_LOG_FORMAT", value_enum, default_value = "text")]
    log_format: LogFormat,
    #[command(flatten)]
    settings: Settings,
}

const EXAMPLES: &str = "Examples:
  sinew-server
  sinew-server --listen 0.0.0.0:7370 --recordings /var/lib/sinew
  SINEW_THREADS=1 sinew-server --config sinew.toml --check-config";

/// The settings that have flags, by their names in [`Config`].
#[derive(clap::Args, Serialize)]
struct Settings {
    /// Where to listen [default: 127.0.0.1:7370].
    #[arg(long, value_name = "ADDRESS:PORT")]
    #[serde(skip_serializing_if = "Option::is_none")]
    listen: Option<SocketAddr>,
    /// Folder for the sessions' recordings (.rrd).
    #[arg(long, value_name = "DIR")]
    #[serde(skip_serializing_if = "Option::is_none")]
    recordings: Option<PathBuf>,
    /// Sessions that may exist at once [default: 64].
    #[arg(long, value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    max_sessions: Option<usize>,
    /// Threads for the kernels; 0 for one per core [default: 0].
    #[arg(long, value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    threads: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum LogFormat {
    Text,
    Json,
}

#[tokio::main]
async fn main() -> ExitCode {
    match run(Flags::parse()).await {
        Ok(code) => code,
        Err(error) => {
            eprintln!("sinew-server: {error}");
            ExitCode::FAILURE
        }
    }
}

async fn run(flags: Flags) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let config = Config::load(flags.config.as_deref(), &flags.settings)?;
    if flags.check_config {
        std::io::stdout().write_all(toml::to_string(&config)?.as_bytes())?;
        return Ok(ExitCode::SUCCESS);
    }
    let filter = EnvFilter::try_new(&flags.log)?;
    let logs = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    match flags.log_format {
        LogFormat::Text => logs.init(),
        LogFormat::Json => logs.json().init(),
    }
    let server = Server::start(config).await?;
    println!(
        "Sinew serves http://{0}/ (gRPC, page) and rerun+http://{0}/proxy",
        server.address()
    );
    stop_asked().await?;
    Ok(match server.shutdown().await {
        Stopped::Drained => ExitCode::SUCCESS,
        Stopped::GraceExpired => ExitCode::from(2),
    })
}

/// Returns at Ctrl-C or, where there are Unix signals, SIGTERM.
async fn stop_asked() -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let mut terminate = signal(SignalKind::terminate())?;
        tokio::select! {
            interrupted = tokio::signal::ctrl_c() => interrupted,
            _ = terminate.recv() => Ok(()),
        }
    }
    #[cfg(not(unix))]
    tokio::signal::ctrl_c().await
}
