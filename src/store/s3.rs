//! A bucket of S3 or of what speaks like it, through the crate `object_store`; its waiting is done on a small runtime of its own.
//!
//! Put-if-absent is `If-None-Match: *`. Settings are those of the `AWS_...` environment: keys, region, `AWS_ENDPOINT_URL`,
//! `AWS_ALLOW_HTTP`.

use futures_util::{StreamExt, TryStreamExt};
use object_store::aws::{AmazonS3, AmazonS3Builder, AmazonS3ConfigKey};
use object_store::client::ClientConfigKey;
use object_store::path::Path as Key;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutPayload, RetryConfig, WriteMultipart};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;

use super::disk::refused;
use super::{Bucket, Store};
use crate::error::{Error, Result};

/// Files up to this are sent in one request, bytes; larger ones in parts of this size, a few at a time.
const PART: usize = 16 << 20;
const AT_ONCE: usize = 3;
/// Requests that fail are tried again, but a person waits for the answer.
const RETRIES: usize = 4;
const PATIENCE: Duration = Duration::from_secs(30);
/// Letters of a refusal that are shown: servers answer with pages.
const SHOWN: usize = 300;

#[derive(Debug)]
struct S3 {
    name: String,
    bucket: String,
    prefix: Key,
    endpoint: String,
    /// Nothing says who asks; a machine in Amazon's cloud may still be known there.
    keyless: bool,
    client: AmazonS3,
    runtime: Runtime,
}

impl Store {
    /// Opens `s3://BUCKET/PREFIX` with a folder below `cache` before it. `settings` are the environment's `AWS_...`.
    pub fn open_s3(url: &str, settings: &BTreeMap<String, String>, cache: &Path) -> Result<Self> {
        let bucket = S3::open(url, settings)?;
        let root = cache.join(bucket.folder());
        Self::open_before(root, Arc::new(bucket))
    }
}

impl S3 {
    /// Nothing is asked yet.
    fn open(url: &str, settings: &BTreeMap<String, String>) -> Result<Self> {
        let shape = || Error::spec(url, "expected s3://BUCKET/PREFIX");
        let path = url
            .strip_prefix("s3://")
            .ok_or_else(shape)?
            .trim_end_matches('/');
        let (bucket, prefix) = path.split_once('/').unwrap_or((path, ""));
        let prefix = Key::parse(prefix).map_err(|_| shape())?;
        if bucket.is_empty() {
            return Err(shape());
        }
        let given = |name: &str| settings.get(name).filter(|value| !value.is_empty());
        let endpoint = given("AWS_ENDPOINT_URL_S3")
            .or_else(|| given("AWS_ENDPOINT_URL"))
            .cloned()
            .unwrap_or_default();
        if endpoint.starts_with("http:") && given("AWS_ALLOW_HTTP").is_none() {
            return Err(Error::spec(
                "AWS_ENDPOINT_URL",
                "is not encrypted: set AWS_ALLOW_HTTP=true where that is meant so",
            ));
        }
        let known = [
            "AWS_ACCESS_KEY_ID",
            "AWS_WEB_IDENTITY_TOKEN_FILE",
            "AWS_SKIP_SIGNATURE",
        ];
        let contained = [
            "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
            "AWS_CONTAINER_CREDENTIALS_FULL_URI",
        ];
        let keyless = known
            .iter()
            .chain(&contained)
            .all(|name| given(name).is_none());
        // The process may have chosen one already, and that one serves as well.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let mut builder = AmazonS3Builder::new();
        for (name, value) in settings {
            if let Ok(key) = name.to_ascii_lowercase().parse() {
                builder = builder.with_config(key, value);
            }
        }
        let retry = RetryConfig {
            max_retries: RETRIES,
            retry_timeout: PATIENCE,
            ..RetryConfig::default()
        };
        // A table may take longer than the 30 s that a request is given otherwise; what stalls is told by its reading.
        let builder = builder
            .with_config(AmazonS3ConfigKey::Client(ClientConfigKey::Timeout), "600s")
            .with_config(
                AmazonS3ConfigKey::Client(ClientConfigKey::ReadTimeout),
                "30s",
            )
            .with_bucket_name(bucket)
            .with_retry(retry);
        let client = builder.build().map_err(|e| {
            Error::spec(
                url,
                format!("cannot be opened: {e}; look at the AWS_... variables"),
            )
        })?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build();
        let runtime =
            runtime.map_err(|e| Error::store(url, format!("no thread for the network: {e}")))?;
        Ok(Self {
            name: format!("s3://{path}"),
            bucket: bucket.into(),
            prefix,
            endpoint,
            keyless,
            client,
            runtime,
        })
    }

    /// A folder name for what is fetched from here; other endpoints have other buckets of the same name.
    fn folder(&self) -> String {
        let hash = blake3::hash(format!("{} {}", self.endpoint, self.name).as_bytes()).to_hex();
        format!("{}-{}", self.bucket, &hash[..16])
    }

    fn key(&self, key: &str) -> Result<Key> {
        let key = if self.prefix.as_ref().is_empty() {
            key.into()
        } else {
            format!("{}/{key}", self.prefix)
        };
        Key::parse(&key).map_err(|e| Error::spec(format!("{}/{key}", self.name), e.to_string()))
    }

    /// What went wrong, and what the reader can do about it.
    fn refused(&self, doing: &str, key: &str, error: object_store::Error) -> Error {
        let text = error
            .to_string()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let mut answer: String = text.chars().take(SHOWN).collect();
        // The first cause (no route, a certificate) is the last of a chain, and a text need not name it.
        let causes =
            std::iter::successors(std::error::Error::source(&error), |error| error.source());
        answer.extend(
            causes
                .last()
                .map(ToString::to_string)
                .filter(|cause| !text.contains(cause))
                .map(|cause| format!(": {cause}")),
        );
        let place = format!("{}/{key}", self.name);
        if text.contains("NoSuchBucket") {
            let message = format!(
                "there is no bucket `{}`; make it first (aws s3 mb s3://{}), or correct the name",
                self.bucket, self.bucket
            );
            return Error::spec(&self.name, message);
        }
        if self.keyless && !matches!(error, object_store::Error::NotFound { .. }) {
            let message = format!(
                "no credentials: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (AWS_REGION, and AWS_ENDPOINT_URL where the bucket is not Amazon's); {answer}"
            );
            return Error::spec(&self.name, message);
        }
        use object_store::Error::{PermissionDenied, Unauthenticated};
        let remedy = match error {
            PermissionDenied { .. } | Unauthenticated { .. } => {
                "look at AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, which must be allowed to list, get, put and delete there"
            }
            _ => {
                "check the network, AWS_ENDPOINT_URL and AWS_REGION, and run again: finished stages are kept"
            }
        };
        Error::store(place, format!("cannot {doing}: {answer}; {remedy}"))
    }
}

/// A key that is not there; a bucket that is not there is another matter.
fn absent(error: &object_store::Error) -> bool {
    matches!(error, object_store::Error::NotFound { .. })
        && !error.to_string().contains("NoSuchBucket")
}

impl Bucket for S3 {
    fn name(&self) -> &str {
        &self.name
    }

    fn fetch(&self, key: &str, to: &Path) -> Result<bool> {
        let at = self.key(key)?;
        self.runtime.block_on(async {
            let found = match self.client.get(&at).await {
                Ok(found) => found,
                Err(error) if absent(&error) => return Ok(false),
                Err(error) => return Err(self.refused("get it", key, error)),
            };
            let mut file = File::create(to).map_err(|e| refused(to, "write", &e))?;
            let mut parts = found.into_stream();
            while let Some(part) = parts.next().await {
                let part = part.map_err(|error| self.refused("get it", key, error))?;
                file.write_all(&part)
                    .map_err(|e| refused(to, "write", &e))?;
            }
            Ok(true)
        })
    }

    fn send(&self, from: &Path, key: &str) -> Result<()> {
        let at = self.key(key)?;
        let file = File::open(from).map_err(|e| refused(from, "read", &e))?;
        let part = || {
            let mut bytes = Vec::new();
            let read = (&file).take(PART as u64).read_to_end(&mut bytes);
            read.map(|_| bytes).map_err(|e| refused(from, "read", &e))
        };
        let first = part()?;
        self.runtime.block_on(async {
            let failed = |error| self.refused("put it", key, error);
            if first.len() < PART {
                return self
                    .client
                    .put(&at, PutPayload::from(first))
                    .await
                    .map(drop)
                    .map_err(failed);
            }
            let upload = self.client.put_multipart(&at).await.map_err(failed)?;
            let mut upload = WriteMultipart::new_with_chunk_size(upload, PART);
            let mut bytes = first;
            while !bytes.is_empty() {
                upload.wait_for_capacity(AT_ONCE).await.map_err(failed)?;
                upload.put(bytes.into());
                bytes = part()?;
            }
            upload.finish().await.map(drop).map_err(failed)
        })
    }

    fn create(&self, from: &Path, key: &str) -> Result<bool> {
        let at = self.key(key)?;
        let bytes = std::fs::read(from).map_err(|e| refused(from, "read", &e))?;
        let put = self
            .client
            .put_opts(&at, PutPayload::from(bytes), PutMode::Create.into());
        match self.runtime.block_on(put) {
            Ok(_) => Ok(true),
            Err(object_store::Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.refused("put it", key, error)),
        }
    }

    fn remove(&self, key: &str) -> Result<()> {
        let at = self.key(key)?;
        match self.runtime.block_on(self.client.delete(&at)) {
            Err(error) if !absent(&error) => Err(self.refused("delete it", key, error)),
            _ => Ok(()),
        }
    }

    fn list(&self, folder: &str, most: usize) -> Result<Vec<(String, u64)>> {
        let below = self.key(folder.trim_end_matches('/'))?;
        let below = (!below.as_ref().is_empty()).then_some(&below);
        let strip = |location: &Key| {
            let parts = location.prefix_match(&self.prefix)?;
            Some(
                parts
                    .map(|part| part.as_ref().to_string())
                    .collect::<Vec<_>>()
                    .join("/"),
            )
        };
        let found = self.client.list(below).take(most).try_collect::<Vec<_>>();
        let found = self
            .runtime
            .block_on(found)
            .map_err(|error| self.refused("list it", folder, error))?;
        let mut keys: Vec<(String, u64)> = found
            .iter()
            .filter_map(|file| Some((strip(&file.location)?, file.size)))
            .collect();
        keys.sort();
        Ok(keys)
    }
}
