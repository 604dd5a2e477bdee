//! The Sinew service: sessions behind gRPC, their Rerun feed and their page, all on one port.

mod assets;
mod change;
mod config;
mod convert;
mod end;
mod error;
mod facts;
mod given;
mod http;
mod inbox;
mod kernels;
mod live;
mod metrics;
mod outlets;
mod pack;
mod registry;
mod seat;
mod server;
mod services;
mod session;
mod status;
mod timing;

pub use config::{Config, ConfigError};
pub use server::{Server, StartError, Stopped};
