"""ROS 2 messages in MCAP files: their definitions, and a writer and reader of whole files.

A definition stands in each file, so that programs decode it without ROS. Field names and types are
those of ROS 2 Humble and later (packages std_msgs, geometry_msgs, sensor_msgs, nav_msgs, tf2_msgs,
trajectory_msgs, diagnostic_msgs, visualization_msgs).
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import MissingPackageError, TraceFileError
from hexapod_pin.user_file import read_bytes, reason_of

MCAP = (".mcap",)

MOST_BYTES = 4_000_000_000
"""Largest file that is read [bytes]."""

NANO = 1_000_000_000
"""Nanoseconds in a second."""

PARTS: Mapping[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "std_msgs/Float64": "float64 data",
    "std_msgs/String": "string data",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "geometry_msgs/PointStamped": "std_msgs/Header header\ngeometry_msgs/Point point",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "sensor_msgs/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
        "float64[] effort"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "nav_msgs/Odometry": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "trajectory_msgs/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint[] points"
    ),
    "trajectory_msgs/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start"
    ),
    "diagnostic_msgs/KeyValue": "string key\nstring value",
    "diagnostic_msgs/DiagnosticStatus": (
        "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
        "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values"
    ),
    "diagnostic_msgs/DiagnosticArray": (
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status"
    ),
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/Marker": (
        "int32 ARROW=0\nint32 ADD=0\nint32 DELETE=2\nstd_msgs/Header header\nstring ns\nint32 id\n"
        "int32 type\nint32 action\ngeometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\n"
        "std_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n"
        "geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\n"
        "string text\nstring mesh_resource\nvisualization_msgs/MeshFile mesh_file\n"
        "bool mesh_use_embedded_materials"
    ),
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
}
"""The fields of messages and of what they are made of."""


def definition(kind: str) -> str:
    """Return the definition of a message with those of its parts, as "ros2msg" schemas have it."""
    found: dict[str, str] = {}

    def collect(name: str) -> None:
        found[name] = PARTS[name]
        for line in PARTS[name].splitlines():
            part = line.split()[0].split("[")[0]
            if part in PARTS and part not in found:
                collect(part)

    collect(kind)
    own, *others = found.items()
    texts = [own[1], *(f"MSG: {name}\n{text}" for name, text in others)]
    return f"\n{'=' * 80}\n".join(texts) + "\n"


def stamp(nanoseconds: int) -> dict[str, int]:
    """Return a time, or a duration, as a message has it."""
    return {"sec": nanoseconds // NANO, "nanosec": nanoseconds % NANO}


def header(nanoseconds: int, frame: str = "") -> dict[str, Any]:
    """Return a header: time and frame."""
    return {"stamp": stamp(nanoseconds), "frame_id": frame}


def vector(values: Iterable[float]) -> dict[str, float]:
    """Return a vector, a point, or a quaternion x, y, z, w."""
    return dict(zip("xyzw", map(float, values), strict=False))


def require_mcap(wanted: str) -> None:
    """Refuse to go on without the packages that read and write MCAP files.

    Raises:
        MissingPackageError: one is not installed.
    """
    try:
        import mcap_ros2  # noqa: F401
    except ImportError as error:
        raise MissingPackageError("mcap-ros2-support", "interchange", wanted) from error


Sent = tuple[str, str, int, Mapping[str, Any]]
"""A message: topic, kind such as "sensor_msgs/JointState", time [ns], fields."""


def write_messages(
    path: str | Path, messages: Iterable[Sent], metadata: Mapping[str, str] | None = None
) -> Path:
    """Write messages into an MCAP file of the profile "ros2", wholly or not at all.

    Args:
        path: ends in .mcap.
        messages: in the order of time.
        metadata: texts by name, kept in a record named "hexapod_pin".

    Raises:
        MissingPackageError: the packages for MCAP are not installed.
        TraceFileError: the file cannot be written.
    """
    require_mcap(str(path))
    from mcap_ros2.writer import Writer

    image = io.BytesIO()
    with Writer(image) as writer:
        schemas: dict[str, Any] = {}
        if metadata:
            writer.add_metadata(METADATA, dict(metadata))
        for topic, kind, time, fields in messages:
            if kind not in schemas:
                name = kind.replace("/", "/msg/")
                schemas[kind] = writer.register_msgdef(name, definition(kind))
            writer.write_message(topic, schemas[kind], fields, log_time=time)
    return write_atomically(path, image.getbuffer())


METADATA = "hexapod_pin"
"""Name of the record of texts in the files that this package writes."""

Received = tuple[str, str, int, Any]
"""A decoded message: topic, kind, time of its log entry [ns], fields as attributes."""


class McapFile:
    """An MCAP file with ROS 2 messages, read into memory and decoded on request."""

    def __init__(self, path: str | Path) -> None:
        """Read the file.

        Raises:
            MissingPackageError: the packages for MCAP are not installed.
            TraceFileError: the file cannot be read.
        """
        require_mcap(str(path))
        self._path = path
        try:
            self._data = read_bytes(path, MOST_BYTES)
        except (OSError, ValueError) as error:
            raise TraceFileError(f"{path}: cannot be read ({reason_of(error)}).") from error

    def metadata(self) -> dict[str, str] | None:
        """Return the texts that this package wrote into it; None of a file of other programs.

        Raises:
            TraceFileError: the file is damaged.
        """
        found = self._guarded(lambda reader: list(reader.iter_metadata()))
        return next((dict(one.metadata) for one in found if one.name == METADATA), None)

    def messages(self, wanted: Mapping[str, str]) -> Iterator[Received]:
        """Yield the messages of some topics in the order of time.

        Args:
            wanted: their kinds by topic; a topic that ends in "/" stands for all that begin so.

        Raises:
            TraceFileError: the file is damaged, or a topic is of another kind.
        """
        places = tuple(name for name in wanted if name.endswith("/"))

        def decoded(reader: Any) -> list[Received]:
            summary = reader.get_summary()
            names = [one.topic for one in summary.channels.values()] if summary else []
            topics = [one for one in names if one in wanted or one.startswith(places or ("\0",))]
            if not topics:
                return []
            found = reader.iter_decoded_messages(topics=topics)
            return [(c.topic, s.name, m.log_time, fields) for s, c, m, fields in found]

        for topic, name, time, fields in self._guarded(decoded):
            kind = wanted.get(topic) or next(wanted[one] for one in places if topic.startswith(one))
            if name.replace("/msg/", "/") != kind:
                raise TraceFileError(f"{self._path}: topic {topic} is of {name} instead of {kind}.")
            yield topic, kind, time, fields

    def _guarded(self, read: Any) -> Any:
        """Return what `read` makes of a reader of the file, or raise what is wrong with it."""
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        try:
            factories = [DecoderFactory()]
            return read(make_reader(io.BytesIO(self._data), decoder_factories=factories))
        except Exception as error:  # readers report damage by many types, struct.error to KeyError
            text = " ".join(str(error).split()) or type(error).__name__
            raise TraceFileError(
                f"{self._path}: damaged, or no MCAP file with ROS 2 messages ({text})."
            ) from error
