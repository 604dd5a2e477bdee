//! SessionService.

use std::{sync::Arc, time::SystemTime};

use prost::Message as _;
use sinew_engine::{UpAxis, World};
use sinew_proto::v1::{self, session_service_server::SessionService};
use sinew_viewer::SessionInfo;
use tonic::{Request, Response, Status};
use xxhash_rust::xxh3::{xxh3_64_with_seed, xxh3_128};

use super::{
    Shared, mapping,
    page::{page_size, page_token, read_token},
};
use crate::{
    convert,
    error::{ServiceError, invalid},
    registry::{Entry, Origin, Reserved},
    seat::Seat,
    session::{Activity, Drive, Handle, Report, Wish},
};

/// Steps that one request may ask for.
const MAX_STEPS: u32 = 10_000;
/// Sessions on a page where the request does not say, and at most.
const PAGE: (usize, usize) = (100, 1000);

#[tonic::async_trait]
impl SessionService for Shared {
    async fn create_session(
        &self,
        request: Request<v1::CreateSessionRequest>,
    ) -> Result<Response<v1::Session>, Status> {
        Ok(Response::new(self.create(request.into_inner()).await?))
    }

    async fn get_session(
        &self,
        request: Request<v1::GetSessionRequest>,
    ) -> Result<Response<v1::Session>, Status> {
        Ok(Response::new(
            self.ask(&request.into_inner().name, Wish::Describe).await?,
        ))
    }

    async fn list_sessions(
        &self,
        request: Request<v1::ListSessionsRequest>,
    ) -> Result<Response<v1::ListSessionsResponse>, Status> {
        Ok(Response::new(self.list(&request.into_inner()).await?))
    }

    async fn delete_session(
        &self,
        request: Request<v1::DeleteSessionRequest>,
    ) -> Result<Response<v1::DeleteSessionResponse>, Status> {
        self.registry.remove(&request.into_inner().name)?;
        self.metrics.sessions.set(self.registry.len() as i64);
        Ok(Response::new(v1::DeleteSessionResponse {}))
    }

    async fn run(&self, request: Request<v1::RunRequest>) -> Result<Response<v1::Session>, Status> {
        Ok(Response::new(
            self.ask(&request.into_inner().name, Wish::Run).await?,
        ))
    }

    async fn pause(
        &self,
        request: Request<v1::PauseRequest>,
    ) -> Result<Response<v1::Session>, Status> {
        Ok(Response::new(
            self.ask(&request.into_inner().name, Wish::Pause).await?,
        ))
    }

    async fn step(
        &self,
        request: Request<v1::StepRequest>,
    ) -> Result<Response<v1::StepResponse>, Status> {
        let v1::StepRequest {
            name,
            steps,
            expected_step,
        } = request.into_inner();
        let entry = self.registry.get(&name)?;
        if steps > MAX_STEPS {
            let remedy = format!("ask for at most {MAX_STEPS} at once");
            return Err(
                invalid("VALUE_OUT_OF_RANGE", "steps", format!("is {steps}"), remedy).into(),
            );
        }
        let wish = Wish::Step {
            steps: steps.max(1),
            expected: expected_step,
        };
        let report = entry.handle.ask(wish).await?;
        Ok(Response::new(v1::StepResponse {
            step: report.frame.step,
            time_seconds: report.frame.time_seconds,
            digest: digest(report.digest),
        }))
    }

    async fn update_mapping(
        &self,
        request: Request<v1::UpdateMappingRequest>,
    ) -> Result<Response<v1::Session>, Status> {
        Ok(Response::new(self.remap(request.into_inner()).await?))
    }

    async fn edit_mesh(
        &self,
        request: Request<v1::EditMeshRequest>,
    ) -> Result<Response<v1::EditMeshResponse>, Status> {
        Ok(Response::new(self.edit(request.into_inner()).await?))
    }

    async fn explain(
        &self,
        request: Request<v1::ExplainRequest>,
    ) -> Result<Response<v1::Explanation>, Status> {
        let v1::ExplainRequest { name, vertex } = request.into_inner();
        let entry = self.registry.get(&name)?;
        let explanation = entry.handle.explain(vertex).await?;
        Ok(Response::new(mapping::explanation(
            vertex,
            explanation,
            &entry.labels,
        )))
    }

    async fn read_modules(
        &self,
        request: Request<v1::ReadModulesRequest>,
    ) -> Result<Response<v1::Modules>, Status> {
        let modules = Shared::read_modules(self, request.into_inner()).await?;
        Ok(Response::new(modules))
    }
}

impl Shared {
    async fn create(&self, request: v1::CreateSessionRequest) -> Result<v1::Session, ServiceError> {
        let hash = xxh3_128(&request.encode_to_vec());
        let v1::CreateSessionRequest {
            session_id,
            scene,
            request_id,
            validate_only,
            run,
        } = request;
        check_request_id(&request_id)?;
        let name = session_name(&session_id, hash)?;
        if validate_only {
            let built = self.build(scene).await?;
            return Ok(validated(name, built));
        }
        let reservation = match self.registry.reserve(&name, Origin { request_id, hash })? {
            Reserved::Known(entry) => return describe(&entry, Wish::Describe).await,
            Reserved::New(reservation) => reservation,
        };
        let Built {
            world,
            mapping,
            drive,
            title,
            labels,
            probes,
            up,
        } = self.build(scene).await?;
        let warnings = world.warnings().to_vec();
        let time_step = world.time_step();
        let publisher = self.viewer.open(&SessionInfo {
            id: name.trim_start_matches("sessions/").to_owned(),
            title: title.clone(),
            labels: labels.clone(),
            probes,
            up,
        });
        let publisher = publisher.map_err(|error| ServiceError::Internal(error.to_string()))?;
        let handle = Handle::spawn(
            world,
            mapping,
            drive,
            self.kernels.clone(),
            publisher,
            Arc::clone(&self.metrics),
            &self.tasks,
        );
        let entry = reservation.fill(Entry {
            name,
            title,
            create_time: SystemTime::now(),
            labels,
            time_step,
            external: drive == Drive::External,
            warnings,
            handle,
            up,
            seat: Seat::default(),
        })?;
        self.metrics.sessions.set(self.registry.len() as i64);
        tracing::info!(session = entry.name, "session created");
        describe(&entry, if run { Wish::Run } else { Wish::Describe }).await
    }

    /// Builds a scene's world on a kernel thread.
    async fn build(&self, scene: Option<v1::Scene>) -> Result<Built, ServiceError> {
        let scene =
            scene.ok_or_else(|| invalid("FIELD_MISSING", "scene", "is missing", "post a scene"))?;
        let assets = Arc::clone(&self.assets);
        let built = self.kernels.run(move || {
            let mapping = scene.mapping.clone().unwrap_or_default();
            let (scene, drive) = convert::scene(scene, &assets)?;
            Ok(Built {
                mapping,
                drive,
                title: scene.title.clone(),
                labels: scene.motion.labels(),
                probes: scene
                    .probes
                    .iter()
                    .map(|probe| probe.name.clone())
                    .collect(),
                up: scene.up,
                world: World::build(scene)?,
            })
        });
        built.await.map_err(ServiceError::Internal)?
    }

    async fn ask(&self, name: &str, wish: Wish) -> Result<v1::Session, ServiceError> {
        describe(&*self.registry.get(name)?, wish).await
    }

    /// One page of sessions.
    pub(crate) async fn list(
        &self,
        request: &v1::ListSessionsRequest,
    ) -> Result<v1::ListSessionsResponse, ServiceError> {
        let size = page_size(request.page_size, PAGE)?;
        let after = read_token(&request.page_token)?;
        let mut entries = self.registry.page(&after, size + 1);
        let more = entries.len() > size;
        entries.truncate(size);
        let mut sessions = Vec::with_capacity(entries.len());
        for entry in &entries {
            // A session deleted since is no longer on the page.
            if let Ok(session) = describe(entry, Wish::Describe).await {
                sessions.push(v1::Session {
                    mapping: None,
                    ..session
                });
            }
        }
        let next_page_token = entries
            .last()
            .filter(|_| more)
            .map(|last| page_token(&last.name))
            .unwrap_or_default();
        Ok(v1::ListSessionsResponse {
            sessions,
            next_page_token,
        })
    }
}

/// What a scene became.
struct Built {
    world: World,
    mapping: v1::Mapping,
    drive: Drive,
    title: String,
    labels: Vec<String>,
    probes: Vec<String>,
    up: UpAxis,
}

fn check_request_id(id: &str) -> Result<(), ServiceError> {
    if id.len() <= 128 {
        return Ok(());
    }
    let problem = format!("has {} bytes", id.len());
    Err(invalid(
        "REQUEST_ID_TOO_LONG",
        "request_id",
        problem,
        "use at most 128",
    ))
}

/// `sessions/{id}`; an id of the server's making where the client gave none.
fn session_name(id: &str, hash: u128) -> Result<String, ServiceError> {
    if id.is_empty() {
        let salt = crate::timing::now_nanos();
        return Ok(format!(
            "sessions/s-{:012x}",
            xxh3_64_with_seed(&hash.to_le_bytes(), salt) >> 16
        ));
    }
    let tail = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
    let valid = id.len() <= 63 && id.as_bytes()[0].is_ascii_lowercase() && id.bytes().all(tail);
    if !valid {
        let remedy = "use 1 to 63 characters from a-z, 0-9 and -, starting with a letter";
        return Err(invalid(
            "ID_INVALID",
            "session_id",
            format!("is `{id}`"),
            remedy,
        ));
    }
    Ok(format!("sessions/{id}"))
}

pub(super) fn digest(digest: u128) -> String {
    format!("{digest:032x}")
}

pub(super) async fn describe(entry: &Entry, wish: Wish) -> Result<v1::Session, ServiceError> {
    let Report {
        activity,
        frame,
        digest: hash,
        mapping,
        rest: _,
        inputs: _,
    } = entry.handle.ask(wish).await?;
    let (state, fault) = match activity {
        Activity::Paused => (v1::SessionState::Paused, None),
        Activity::Running => (v1::SessionState::Running, None),
        Activity::Faulted(fault) => {
            let fault = v1::Fault {
                reason: fault.reason.to_owned(),
                message: fault.message,
            };
            (v1::SessionState::Faulted, Some(fault))
        }
    };
    Ok(v1::Session {
        name: entry.name.clone(),
        state: state.into(),
        create_time: Some(timestamp(entry.create_time)),
        step: frame.step,
        time_seconds: frame.time_seconds,
        digest: digest(hash),
        title: entry.title.clone(),
        point_count: count(frame.points.len()),
        vertex_count: count(frame.vertices.len()),
        cell_count: count(frame.layout.cells.len()),
        time_step_seconds: entry.time_step,
        external_motion: entry.external,
        fault,
        warnings: entry.warnings.clone(),
        etag: mapping::etag(&mapping),
        mapping: Some(v1::Mapping::clone(&mapping)),
    })
}

/// What a scene would become.
fn validated(name: String, built: Built) -> v1::Session {
    let Built { world, mapping, .. } = built;
    let frame = world.frame();
    v1::Session {
        name,
        state: v1::SessionState::Paused.into(),
        digest: digest(world.digest()),
        point_count: count(frame.points.len()),
        vertex_count: count(frame.vertices.len()),
        cell_count: count(frame.layout.cells.len()),
        time_step_seconds: world.time_step(),
        warnings: world.warnings().to_vec(),
        etag: mapping::etag(&mapping),
        mapping: Some(mapping),
        ..v1::Session::default()
    }
}

/// Counts that travel fit: indices are 32-bit.
pub(super) fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn timestamp(time: SystemTime) -> sinew_proto::Timestamp {
    let since = time
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    sinew_proto::Timestamp {
        seconds: i64::try_from(since.as_secs()).unwrap_or(i64::MAX),
        nanos: i32::try_from(since.subsec_nanos()).unwrap_or(0),
    }
}
