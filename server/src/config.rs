//! What a server can be told at its start: defaults, then a TOML file, then the environment
//! (`SINEW_LISTEN`, …), then flags.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

use figment::{
    Figment,
    providers::{Env, Format, Serialized, Toml},
};
use serde::{Deserialize, Serialize};

/// Settings of a server.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where to listen. Port 0 takes any free port.
    pub listen: SocketAddr,
    /// Folder in which each session's recording `{id}.rrd` is written; none without.
    pub recordings: Option<PathBuf>,
    /// Sessions that may exist at once.
    pub max_sessions: usize,
    /// Largest message taken, bytes.
    pub max_message_bytes: usize,
    /// All uploaded assets together, bytes.
    pub max_asset_bytes: u64,
    /// Time that streams get to end on shutdown, s.
    pub grace_seconds: f64,
    /// Threads for the kernels; 0 for one per core.
    pub threads: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 7370)),
            recordings: None,
            max_sessions: 64,
            max_message_bytes: 4 << 20,
            max_asset_bytes: 2 << 30,
            grace_seconds: 5.0,
            threads: 0,
        }
    }
}

/// Why settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file is not there.
    #[error("cannot read the configuration file {}: {source}", path.display())]
    File {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A setting is unknown or of the wrong type.
    #[error("{0}")]
    Garbled(Box<figment::Error>),
    /// A setting's value cannot be.
    #[error("{setting} is {value}; {remedy}")]
    Value {
        /// Its name.
        setting: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        remedy: &'static str,
    },
}

impl Config {
    /// Reads the settings; `flags` are those given on the command line, by their names here.
    ///
    /// # Errors
    /// [`ConfigError`] names the setting and where it came from.
    pub fn load(file: Option<&Path>, flags: impl Serialize) -> Result<Self, ConfigError> {
        let mut figment = Figment::from(Serialized::defaults(Self::default()));
        if let Some(path) = file {
            let text = std::fs::read_to_string(path).map_err(|source| ConfigError::File {
                path: path.to_owned(),
                source,
            })?;
            figment = figment.merge(Toml::string(&text));
        }
        // SINEW_CONFIG names the file and SINEW_LOG the filter: no settings of the server.
        let environment = Env::prefixed("SINEW_").ignore(&["config", "log", "log_format"]);
        figment
            .merge(environment)
            .merge(Serialized::defaults(flags))
            .extract::<Self>()
            .map_err(|error| ConfigError::Garbled(Box::new(error)))?
            .checked()
    }

    fn checked(self) -> Result<Self, ConfigError> {
        let refuse = |setting, value: String, remedy| {
            Err(ConfigError::Value {
                setting,
                value,
                remedy,
            })
        };
        if !(0.0..=3600.0).contains(&self.grace_seconds) {
            return refuse(
                "grace_seconds",
                self.grace_seconds.to_string(),
                "give 0 to 3600",
            );
        }
        if self.max_sessions == 0 {
            return refuse("max_sessions", "0".to_owned(), "give at least 1");
        }
        if self.max_message_bytes < 64 << 10 {
            return refuse(
                "max_message_bytes",
                self.max_message_bytes.to_string(),
                "give at least 65536",
            );
        }
        if self.threads > 1024 {
            return refuse(
                "threads",
                self.threads.to_string(),
                "give at most 1024; 0 for one per core",
            );
        }
        Ok(self)
    }
}

#[cfg(test)]
#[expect(
    clippy::result_large_err,
    reason = "figment's Jail fixes the error type"
)]
mod tests {
    use std::collections::BTreeMap;

    use figment::Jail;

    use super::*;

    fn none() -> BTreeMap<String, String> {
        BTreeMap::new()
    }

    #[test]
    fn flags_win_over_the_environment_over_the_file_over_the_defaults() {
        Jail::expect_with(|jail| {
            jail.create_file(
                "s.toml",
                "max_sessions = 2\nthreads = 2\ngrace_seconds = 2.0",
            )?;
            jail.set_env("SINEW_THREADS", "3");
            jail.set_env("SINEW_MAX_SESSIONS", "3");
            let flags = BTreeMap::from([("max_sessions", 4)]);
            let config = Config::load(Some(Path::new("s.toml")), flags).expect("settings are good");
            assert_eq!(
                (config.max_sessions, config.threads, config.grace_seconds),
                (4, 3, 2.0)
            );
            assert_eq!(config.listen, Config::default().listen);
            Ok(())
        });
    }

    #[test]
    fn an_unknown_setting_is_named() {
        Jail::expect_with(|jail| {
            jail.create_file("s.toml", "max_sesions = 2")?;
            let error = Config::load(Some(Path::new("s.toml")), none()).expect_err("a typo");
            assert!(error.to_string().contains("max_sesions"), "{error}");
            Ok(())
        });
    }

    #[test]
    fn a_value_out_of_range_is_named_with_its_remedy() {
        let error = Config {
            max_sessions: 0,
            ..Config::default()
        }
        .checked()
        .expect_err("none");
        assert_eq!(error.to_string(), "max_sessions is 0; give at least 1");
    }
}
