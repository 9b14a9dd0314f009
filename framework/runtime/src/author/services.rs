//! Services: shared read-only objects, such as terrain or gravity, that models query. A kind of service is a trait.
//!
//! A library defines a kind with a trait and an implementation of [`Provided`] for its trait object.
use crate::author::error::BuildError;
use crate::author::value::remedy;
use linkwork_spatial::Vec3;
use std::any::{Any, TypeId};
use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

/// A trait that services provide. It is implemented for the trait object: `impl Provided for dyn Terrain`.
pub trait Provided: Send + Sync + 'static {
    /// The kind as a word, for messages and lists: `terrain`.
    const WORD: &'static str;
    /// Whether services of this kind are built before all others, which may read them. A simulation has at most one service of such a kind.
    const FIRST: bool = false;
    /// True if the runtime calls [`Provided::out_of_range`] at each row for the nodes of the parts that use the service.
    const LOCAL: bool = false;
    /// Returns message and remedy for a part that needs a service of this kind while the simulation does not contain one.
    fn missing() -> (String, String) {
        let word = Self::WORD;
        (
            format!("needs a {word} service, but there is none"),
            format!("add a part that provides {word}"),
        )
    }
    /// Returns an error if the service cannot answer at t (s).
    fn failure(&self, _t: f64) -> Option<BuildError> {
        None
    }
    /// Returns an error if p (m, W) lies outside the range of its data at t (s).
    fn out_of_range(&self, _t: f64, _p: Vec3) -> Option<BuildError> {
        None
    }
    /// Returns whether W rotates according to this service; a model that assumes inertial axes is then rejected.
    fn rotates(&self) -> bool {
        false
    }
    /// Returns the contradictions between this service, which is built at `path`, and the others of the simulation.
    fn contradictions(&self, _path: &str, _services: &Services) -> Vec<Contradiction> {
        Vec::new()
    }
    /// Returns the content as a text, for the hash of a plan with parts that read a service of the [`Host`](crate::Host).
    fn fingerprint(&self) -> String {
        String::new()
    }
}

/// Services of a simulation contradict each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// Path of the service at fault.
    pub path: String,
    /// What it contradicts.
    pub fact: String,
    /// The remedy.
    pub help: String,
}

/// Kind of a service: a trait that services provide.
#[derive(Clone, Copy)]
pub struct ServiceKind {
    id: TypeId,
    word: &'static str,
    first: bool,
    local: bool,
}

impl ServiceKind {
    /// Returns the kind of the services that provide a trait: `ServiceKind::of::<dyn Terrain>()`.
    pub fn of<T: ?Sized + Provided>() -> Self {
        ServiceKind { id: TypeId::of::<T>(), word: T::WORD, first: T::FIRST, local: T::LOCAL }
    }
    /// Returns the kind as a word.
    pub fn text(self) -> &'static str {
        self.word
    }
    /// Returns whether services of this kind are built before all others ([`Provided::FIRST`]).
    pub fn is_first(self) -> bool {
        self.first
    }
    /// Returns whether its range is checked at nodes ([`Provided::LOCAL`]).
    pub fn is_local(self) -> bool {
        self.local
    }
}

impl PartialEq for ServiceKind {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl Eq for ServiceKind {}

impl std::fmt::Debug for ServiceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word)
    }
}

/// Functions of a service that the runtime calls without knowing its kind.
trait Object: Any + Send + Sync {
    fn kind(&self) -> ServiceKind;
    fn failure(&self, t: f64) -> Option<BuildError>;
    fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError>;
    fn rotates(&self) -> bool;
    fn contradictions(&self, path: &str, services: &Services) -> Vec<Contradiction>;
    fn fingerprint(&self) -> String;
}

/// A shared trait object as a sized type, because only sized types can be found by their type.
struct Shared<T: ?Sized>(Arc<T>);

impl<T: ?Sized + Provided> Object for Shared<T> {
    fn kind(&self) -> ServiceKind {
        ServiceKind::of::<T>()
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        Provided::failure(&*self.0, t)
    }
    fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError> {
        Provided::out_of_range(&*self.0, t, p)
    }
    fn rotates(&self) -> bool {
        self.0.rotates()
    }
    fn contradictions(&self, path: &str, services: &Services) -> Vec<Contradiction> {
        self.0.contradictions(path, services)
    }
    fn fingerprint(&self) -> String {
        self.0.fingerprint()
    }
}

/// A service object of any kind, shared.
#[derive(Clone)]
pub struct ServiceObject(Arc<dyn Object>);

impl ServiceObject {
    /// Creates a service that provides a trait: `ServiceObject::new::<dyn Terrain>(Arc::new(terrain))`.
    pub fn new<T: ?Sized + Provided>(object: Arc<T>) -> Self {
        ServiceObject(Arc::new(Shared(object)))
    }
    /// Returns the object as this trait, if it has this kind.
    pub fn get<T: ?Sized + Provided>(&self) -> Option<&Arc<T>> {
        let object: &dyn Any = &*self.0;
        object.downcast_ref::<Shared<T>>().map(|shared| &shared.0)
    }
    /// Returns the kind of the service.
    pub fn kind(&self) -> ServiceKind {
        self.0.kind()
    }
    /// Returns an error if p (m, W) lies outside the range of its data.
    pub fn out_of_range(&self, t: f64, p: Vec3) -> Option<BuildError> {
        self.0.out_of_range(t, p)
    }
    /// Returns an error if the service cannot answer at t (s).
    pub fn failure(&self, t: f64) -> Option<BuildError> {
        self.0.failure(t)
    }
}

/// A bound service: dereferences to the trait.
pub struct Handle<T: ?Sized> {
    object: Arc<T>,
    path: Arc<str>,
}

impl<T: ?Sized> Handle<T> {
    /// Wraps an object, for tests and built assemblies.
    pub fn new(path: &str, object: Arc<T>) -> Self {
        Handle { object, path: path.into() }
    }
    /// Path of the provider.
    pub fn path(&self) -> &str {
        &self.path
    }
    /// The shared object.
    pub fn object(&self) -> &Arc<T> {
        &self.object
    }
}
impl<T: ?Sized> Clone for Handle<T> {
    fn clone(&self) -> Self {
        Handle { object: self.object.clone(), path: self.path.clone() }
    }
}
impl<T: ?Sized> Deref for Handle<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.object
    }
}
impl<T: ?Sized> std::fmt::Debug for Handle<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Handle({})", self.path)
    }
}

/// All services of a simulation, by path.
#[derive(Clone, Default)]
pub struct Services {
    objects: BTreeMap<String, ServiceObject>,
    /// Services with errors: their absence is not reported as a second error.
    pub(crate) failed: Vec<(String, ServiceKind)>,
    /// The service of the host, which has no path.
    of_host: Option<ServiceObject>,
}

impl Services {
    /// Creates a set that contains only the service of the host.
    pub(crate) fn with_host(of_host: Option<ServiceObject>) -> Self {
        Services { of_host, ..Services::default() }
    }

    /// Returns the service of the host, if it has this kind.
    pub fn of_host<T: ?Sized + Provided>(&self) -> Option<&Arc<T>> {
        self.of_host.as_ref()?.get()
    }

    /// Returns the content of the service of the host as a text, if this predicate holds for its kind.
    pub(crate) fn fingerprint_of_host(&self, is_read: impl Fn(ServiceKind) -> bool) -> String {
        let read = self.of_host.as_ref().filter(|object| is_read(object.kind()));
        read.map_or_else(String::new, |object| object.0.fingerprint())
    }

    /// Returns the path of the first service according to which W rotates.
    pub fn rotating(&self) -> Option<&str> {
        self.iter().find(|(_, object)| object.0.rotates()).map(|(path, _)| path)
    }

    /// Returns all contradictions between the services.
    pub fn contradictions(&self) -> Vec<Contradiction> {
        self.iter().flat_map(|(path, object)| object.0.contradictions(path, self)).collect()
    }

    /// Adds a service.
    pub fn add(&mut self, path: impl Into<String>, object: ServiceObject) {
        self.objects.insert(path.into(), object);
    }

    /// Returns the first service that cannot answer at t (s), and the reason.
    pub(crate) fn failure(&self, t: f64) -> Option<(&str, BuildError)> {
        self.objects.iter().find_map(|(path, object)| Some((path.as_str(), object.failure(t)?)))
    }

    /// Returns whether the service at `path` exists and cannot answer at t (s).
    pub(crate) fn is_troubled(&self, path: &str, t: f64) -> bool {
        self.objects.get(path).is_some_and(|object| object.failure(t).is_some())
    }

    /// Returns all services, by path.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &ServiceObject)> {
        self.objects.iter().map(|(p, o)| (p.as_str(), o))
    }

    /// Returns the first service of a kind, by path, with the path of its part.
    pub fn first<T: ?Sized + Provided>(&self) -> Option<Handle<T>> {
        self.iter().find_map(|(path, object)| Some(Handle::new(path, object.get::<T>()?.clone())))
    }

    /// Returns the service at `path`, or without a path the provider nearest to `user` in the tree.
    ///
    /// # Errors
    /// Returns message and remedy, or `None` if the provider itself has an error that was already reported.
    pub fn find<T: ?Sized + Provided>(
        &self,
        path: Option<&str>,
        user: &str,
    ) -> Result<Handle<T>, Option<(String, String)>> {
        let of_kind: Vec<(&str, Arc<T>)> =
            self.iter().filter_map(|(p, o)| Some((p, o.get::<T>()?.clone()))).collect();
        let paths: Vec<&str> = of_kind.iter().map(|(p, _)| *p).collect();
        let kind = T::WORD;
        let mut refused = self.failed.iter().filter(|(_, kind)| *kind == ServiceKind::of::<T>());
        match path {
            Some(path) => {
                // The path is absolute or relative to an enclosing assembly of the user.
                let mut scope = user;
                loop {
                    let full =
                        if scope.is_empty() { path.to_string() } else { format!("{scope}.{path}") };
                    if let Some((p, o)) = of_kind.iter().find(|(p, _)| *p == full) {
                        return Ok(Handle::new(p, o.clone()));
                    }
                    if refused.clone().any(|(p, _)| *p == full) {
                        return Err(None);
                    }
                    if scope.is_empty() {
                        break;
                    }
                    scope = scope.rsplit_once('.').map_or("", |(head, _)| head);
                }
                Err(Some((
                    format!("there is no {kind} service `{path}`"),
                    remedy(path, &format!("{kind} services"), &paths),
                )))
            }
            None => {
                let shared =
                    |p: &str| p.split('.').zip(user.split('.')).take_while(|(a, b)| a == b).count();
                let best = of_kind.iter().map(|(p, _)| shared(p)).max();
                let nearest: Vec<_> =
                    of_kind.iter().filter(|(p, _)| Some(shared(p)) == best).collect();
                match nearest.as_slice() {
                    [(p, o)] => Ok(Handle::new(p, o.clone())),
                    _ if refused.next().is_some() => Err(None),
                    [] => Err(Some(T::missing())),
                    _ => Err(Some((
                        format!("needs a {kind} service, but there are {}", nearest.len()),
                        format!("name one of: {}", paths.join(", ")),
                    ))),
                }
            }
        }
    }
}
