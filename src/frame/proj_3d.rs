//! PROJ's transformations of places with heights, through its C interface.
//!
//! Everything unsafe in the program stands here. What makes it sound: every PROJ object is made in a
//! context of its own that nothing else touches, is destroyed before it and exactly once, and never
//! leaves its thread (raw pointers are neither `Send` nor `Sync`); every text PROJ hands out is copied
//! before the next call; every pointer is checked for null.

use std::ffi::{CStr, CString, c_char, c_int};
use std::ptr;

use proj_sys as sys;

/// A way between two coordinate reference systems that PROJ knows of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Operation {
    /// As PROJ text, from and to longitude and latitude in degrees and a height; `None` where PROJ
    /// cannot write it down.
    pub pipeline: Option<String>,
    /// The grids it needs.
    pub grids: Vec<Grid>,
}

/// A file of shifts an operation needs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub name: String,
    /// Where it stands; `None` where PROJ does not find it.
    pub path: Option<String>,
}

/// The ways from one coordinate reference system to another around a place, PROJ's favourite first,
/// whether their grids are at hand or not. Those that leave heights as they are for want of a better
/// way are left out. The place is west, south, east, north in degrees.
///
/// # Errors
/// What PROJ says where it does not know one of the two.
pub(super) fn operations(
    source: &str,
    target: &str,
    around_deg: [f64; 4],
) -> Result<Vec<Operation>, String> {
    let context = Context::new()?;
    let (source, target) = (context.object(source)?, context.object(target)?);
    let [west, south, east, north] = around_deg;
    // SAFETY: the context is alive for the whole block, and so are both ends; the factory is checked
    // for null before use and destroyed once; the list is taken over by `List`.
    let list = unsafe {
        let factory = sys::proj_create_operation_factory_context(context.0, ptr::null());
        if factory.is_null() {
            return Err(context.problem());
        }
        sys::proj_operation_factory_context_set_area_of_interest(
            context.0, factory, west, south, east, north,
        );
        sys::proj_operation_factory_context_set_allow_ballpark_transformations(
            context.0, factory, 0,
        );
        sys::proj_operation_factory_context_set_spatial_criterion(
            context.0,
            factory,
            sys::PROJ_SPATIAL_CRITERION_PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION,
        );
        sys::proj_operation_factory_context_set_grid_availability_use(
            context.0,
            factory,
            sys::PROJ_GRID_AVAILABILITY_USE_PROJ_GRID_AVAILABILITY_IGNORED,
        );
        let list = sys::proj_create_operations(context.0, source.0, target.0, factory);
        sys::proj_operation_factory_context_destroy(factory);
        List(list)
    };
    Ok(list.operations(&context))
}

/// The folders PROJ looks for grids in, by the environment.
pub(super) fn search_path() -> String {
    // SAFETY: the structure's texts belong to PROJ and are copied at once.
    unsafe { text(sys::proj_info().searchpath) }.unwrap_or_default()
}

/// A transformation ready for use by one thread.
pub(super) struct Pipeline {
    /// Destroyed before its context: fields go in this order.
    object: Object,
    _context: Context,
}

impl Pipeline {
    /// From PROJ text.
    ///
    /// # Errors
    /// What PROJ says where it cannot be made, such as for a grid that cannot be opened.
    pub fn new(definition: &str) -> Result<Self, String> {
        let context = Context::new()?;
        Ok(Self {
            object: context.object(definition)?,
            _context: context,
        })
    }

    /// A place and height through it, forwards or backwards; `None` where it does not reach.
    pub fn transform(&self, [x, y, z]: [f64; 3], backwards: bool) -> Option<[f64; 3]> {
        let direction = if backwards {
            sys::PJ_DIRECTION_PJ_INV
        } else {
            sys::PJ_DIRECTION_PJ_FWD
        };
        // Without a time: transformations that need one fail.
        let coordinate = sys::PJ_COORD {
            v: [x, y, z, f64::INFINITY],
        };
        // SAFETY: the object and its context are alive and used by this thread alone; every member
        // of the union is made of numbers, for which every bit pattern is valid.
        let [x, y, z, _] = unsafe {
            sys::proj_errno_reset(self.object.0);
            sys::proj_trans(self.object.0, direction, coordinate).v
        };
        let all = [x, y, z];
        // PROJ marks failure by infinities.
        all.iter().all(|v| v.is_finite()).then_some(all)
    }
}

/// A context, which keeps PROJ's state.
struct Context(*mut sys::PJ_CONTEXT);

impl Context {
    fn new() -> Result<Self, String> {
        // SAFETY: takes nothing; the result is checked for null.
        let context = unsafe { sys::proj_context_create() };
        if context.is_null() {
            return Err("PROJ has no memory left".to_owned());
        }
        // SAFETY: the context is alive. What goes wrong is told by results, not on the terminal.
        unsafe { sys::proj_log_level(context, sys::PJ_LOG_LEVEL_PJ_LOG_NONE) };
        Ok(Self(context))
    }

    /// An object from its definition. It must not outlive the context.
    fn object(&self, definition: &str) -> Result<Object, String> {
        let definition = CString::new(definition).map_err(|error| error.to_string())?;
        // SAFETY: the context is alive, and the text ends in a null byte and outlives the call.
        let object = unsafe { sys::proj_create(self.0, definition.as_ptr()) };
        if object.is_null() {
            return Err(self.problem());
        }
        Ok(Object(object))
    }

    /// What went wrong last.
    fn problem(&self) -> String {
        // SAFETY: the context is alive; the text is copied at once.
        let problem = unsafe {
            let number = sys::proj_context_errno(self.0);
            text(sys::proj_context_errno_string(self.0, number))
        };
        problem.unwrap_or_else(|| "PROJ does not say why".to_owned())
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: it was made by `new`, and whatever was made in it is gone.
        unsafe { sys::proj_context_destroy(self.0) };
    }
}

/// A coordinate reference system or an operation; never null.
struct Object(*mut sys::PJ);

impl Drop for Object {
    fn drop(&mut self) {
        // SAFETY: it came from PROJ, is owned here alone, and its context is still alive.
        unsafe { sys::proj_destroy(self.0) };
    }
}

/// A list of operations; null where PROJ made none.
struct List(*mut sys::PJ_OBJ_LIST);

impl List {
    fn operations(&self, context: &Context) -> Vec<Operation> {
        if self.0.is_null() {
            return Vec::new();
        }
        // SAFETY: the list is not null and is alive.
        let count = unsafe { sys::proj_list_get_count(self.0) };
        (0..count)
            .filter_map(|index| {
                // SAFETY: the index is within the list; the result is the caller's to destroy.
                let object = unsafe { sys::proj_list_get(context.0, self.0, index) };
                (!object.is_null()).then(|| operation(context, &Object(object)))
            })
            .collect()
    }
}

impl Drop for List {
    fn drop(&mut self) {
        // SAFETY: it came from PROJ and is owned here alone; null is allowed.
        unsafe { sys::proj_list_destroy(self.0) };
    }
}

fn operation(context: &Context, object: &Object) -> Operation {
    // SAFETY: context and object are alive; the new object is the caller's to destroy, and null
    // where the axes cannot be put in order; the text is copied at once.
    let pipeline = unsafe {
        let ordered = sys::proj_normalize_for_visualization(context.0, object.0);
        if ordered.is_null() {
            None
        } else {
            let ordered = Object(ordered);
            let kind = sys::PJ_PROJ_STRING_TYPE_PJ_PROJ_5;
            text(sys::proj_as_proj_string(
                context.0,
                ordered.0,
                kind,
                ptr::null(),
            ))
        }
    };
    // SAFETY: context and object are alive.
    let count = unsafe { sys::proj_coordoperation_get_grid_used_count(context.0, object.0) };
    let grids = (0..count).filter_map(|index| grid(context, object, index));
    Operation {
        pipeline,
        grids: grids.collect(),
    }
}

fn grid(context: &Context, object: &Object, index: c_int) -> Option<Grid> {
    let (mut name, mut path): (*const c_char, *const c_char) = (ptr::null(), ptr::null());
    let mut is_there: c_int = 0;
    // SAFETY: context and object are alive, the index is below the count; the places written to live
    // through the call, and null is allowed for what is not asked. The texts belong to the object
    // and are copied before it is used again.
    unsafe {
        let told = sys::proj_coordoperation_get_grid_used(
            context.0,
            object.0,
            index,
            &raw mut name,
            &raw mut path,
            ptr::null_mut(),
            ptr::null_mut(),
            ptr::null_mut(),
            ptr::null_mut(),
            &raw mut is_there,
        );
        (told != 0).then_some(())?;
        Some(Grid {
            name: text(name)?,
            path: text(path).filter(|path| is_there != 0 && !path.is_empty()),
        })
    }
}

/// A copy of a text of PROJ's; `None` for null.
///
/// # Safety
/// The pointer is null, or to a text that ends in a null byte and stays through the call.
unsafe fn text(pointer: *const c_char) -> Option<String> {
    if pointer.is_null() {
        return None;
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(pointer) };
    Some(text.to_string_lossy().into_owned())
}
