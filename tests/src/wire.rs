//! Bytes on the wire, for what the generated client cannot say.

use std::net::SocketAddr;

use bytes::{BufMut as _, Bytes, BytesMut};
use http_body_util::{BodyExt as _, Full};
use hyper::{HeaderMap, Request, Response, StatusCode, body::Incoming, client::conn};
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::net::TcpStream;
use tonic::Status;

use crate::Refusal;

/// What a plain HTTP request got.
#[derive(Debug)]
pub struct Page {
    /// The status.
    pub status: StatusCode,
    /// The headers.
    pub headers: HeaderMap,
    /// The body.
    pub body: Bytes,
}

impl Page {
    /// The body as text.
    pub fn text(&self) -> &str {
        str::from_utf8(&self.body).unwrap()
    }
}

/// A connection of HTTP/1.1 that stays open between requests.
pub struct Http1(conn::http1::SendRequest<Full<Bytes>>);

impl Http1 {
    /// Connects.
    pub async fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).await.unwrap();
        let (sender, connection) = conn::http1::handshake(TokioIo::new(stream)).await.unwrap();
        tokio::spawn(connection);
        Self(sender)
    }

    /// Asks for a page; nothing where the server has closed the connection.
    pub async fn try_get(&mut self, path: &str) -> Option<Page> {
        let request = Request::get(path).header("host", "localhost");
        self.send(request.body(Full::default()).unwrap()).await
    }

    /// Asks for a page.
    pub async fn get(&mut self, path: &str) -> Page {
        self.try_get(path).await.unwrap()
    }

    /// Sends a request.
    pub async fn send(&mut self, request: Request<Full<Bytes>>) -> Option<Page> {
        self.0.ready().await.ok()?;
        let response = self.0.send_request(request).await.ok()?;
        let (parts, body) = response.into_parts();
        Some(Page {
            status: parts.status,
            headers: parts.headers,
            body: body.collect().await.ok()?.to_bytes(),
        })
    }
}

/// A message in gRPC's frame.
pub fn framed(message: &[u8]) -> Bytes {
    claimed(message, message.len())
}

/// A message in a frame that claims this length.
pub fn claimed(message: &[u8], length: usize) -> Bytes {
    let mut frame = BytesMut::new();
    frame.put_u8(0); // not compressed
    frame.put_u32(u32::try_from(length).unwrap());
    frame.extend_from_slice(message);
    frame.freeze()
}

/// Opens a call of a method with these bytes as the request's body, over HTTP/2.
pub async fn open(address: SocketAddr, method: &str, body: Bytes) -> Incoming {
    request(address, method, &[], body).await.into_body()
}

/// Calls a method with these bytes as the request's body, over HTTP/2, and reads how the call ended.
pub async fn call(
    address: SocketAddr,
    method: &str,
    headers: &[(&'static str, &str)],
    body: Bytes,
) -> Result<Bytes, Refusal> {
    let response = request(address, method, headers, body).await;
    let in_headers = Status::from_header_map(response.headers());
    let collected = response.into_body().collect().await.unwrap();
    let in_trailers = collected.trailers().and_then(Status::from_header_map);
    let status = in_headers
        .or(in_trailers)
        .expect("every call ends with a status");
    if status.code() == tonic::Code::Ok {
        Ok(collected.to_bytes())
    } else {
        Err(Refusal::of(status))
    }
}

async fn request(
    address: SocketAddr,
    method: &str,
    headers: &[(&'static str, &str)],
    body: Bytes,
) -> Response<Incoming> {
    let stream = TcpStream::connect(address).await.unwrap();
    let handshake = conn::http2::handshake(TokioExecutor::new(), TokioIo::new(stream));
    let (mut sender, connection) = handshake.await.unwrap();
    tokio::spawn(connection);
    let mut request = Request::post(format!("http://{address}/{method}"))
        .header("content-type", "application/grpc")
        .header("te", "trailers");
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    let request = request.body(Full::new(body)).unwrap();
    sender.send_request(request).await.unwrap()
}
