from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class DescribeRequest(_message.Message):
    __slots__ = ("task",)
    TASK_FIELD_NUMBER: _ClassVar[int]
    task: str
    def __init__(self, task: _Optional[str] = ...) -> None: ...

class DescribeReply(_message.Message):
    __slots__ = ("policies", "bodies", "joints", "control_hz", "simulation_hz", "limits", "mjcf")
    POLICIES_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    CONTROL_HZ_FIELD_NUMBER: _ClassVar[int]
    SIMULATION_HZ_FIELD_NUMBER: _ClassVar[int]
    LIMITS_FIELD_NUMBER: _ClassVar[int]
    MJCF_FIELD_NUMBER: _ClassVar[int]
    policies: _containers.RepeatedCompositeFieldContainer[PolicyDescription]
    bodies: _containers.RepeatedCompositeFieldContainer[Body]
    joints: _containers.RepeatedCompositeFieldContainer[Joint]
    control_hz: float
    simulation_hz: float
    limits: Limits
    mjcf: str
    def __init__(self, policies: _Optional[_Iterable[_Union[PolicyDescription, _Mapping]]] = ..., bodies: _Optional[_Iterable[_Union[Body, _Mapping]]] = ..., joints: _Optional[_Iterable[_Union[Joint, _Mapping]]] = ..., control_hz: _Optional[float] = ..., simulation_hz: _Optional[float] = ..., limits: _Optional[_Union[Limits, _Mapping]] = ..., mjcf: _Optional[str] = ...) -> None: ...

class PolicyDescription(_message.Message):
    __slots__ = ("name", "task", "version", "checkpoint", "iteration", "samples", "state", "goal", "action", "training_data", "licence", "evaluation", "reward_terms", "success_m", "reloads", "last_refusal")
    NAME_FIELD_NUMBER: _ClassVar[int]
    TASK_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    CHECKPOINT_FIELD_NUMBER: _ClassVar[int]
    ITERATION_FIELD_NUMBER: _ClassVar[int]
    SAMPLES_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TRAINING_DATA_FIELD_NUMBER: _ClassVar[int]
    LICENCE_FIELD_NUMBER: _ClassVar[int]
    EVALUATION_FIELD_NUMBER: _ClassVar[int]
    REWARD_TERMS_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_M_FIELD_NUMBER: _ClassVar[int]
    RELOADS_FIELD_NUMBER: _ClassVar[int]
    LAST_REFUSAL_FIELD_NUMBER: _ClassVar[int]
    name: str
    task: str
    version: str
    checkpoint: str
    iteration: int
    samples: int
    state: _containers.RepeatedCompositeFieldContainer[Feature]
    goal: _containers.RepeatedCompositeFieldContainer[Feature]
    action: Action
    training_data: str
    licence: str
    evaluation: str
    reward_terms: _containers.RepeatedCompositeFieldContainer[RewardTerm]
    success_m: float
    reloads: int
    last_refusal: str
    def __init__(self, name: _Optional[str] = ..., task: _Optional[str] = ..., version: _Optional[str] = ..., checkpoint: _Optional[str] = ..., iteration: _Optional[int] = ..., samples: _Optional[int] = ..., state: _Optional[_Iterable[_Union[Feature, _Mapping]]] = ..., goal: _Optional[_Iterable[_Union[Feature, _Mapping]]] = ..., action: _Optional[_Union[Action, _Mapping]] = ..., training_data: _Optional[str] = ..., licence: _Optional[str] = ..., evaluation: _Optional[str] = ..., reward_terms: _Optional[_Iterable[_Union[RewardTerm, _Mapping]]] = ..., success_m: _Optional[float] = ..., reloads: _Optional[int] = ..., last_refusal: _Optional[str] = ...) -> None: ...

class Feature(_message.Message):
    __slots__ = ("name", "width", "frame", "unit")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    name: str
    width: int
    frame: str
    unit: str
    def __init__(self, name: _Optional[str] = ..., width: _Optional[int] = ..., frame: _Optional[str] = ..., unit: _Optional[str] = ...) -> None: ...

class RewardTerm(_message.Message):
    __slots__ = ("name", "weight")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WEIGHT_FIELD_NUMBER: _ClassVar[int]
    name: str
    weight: float
    def __init__(self, name: _Optional[str] = ..., weight: _Optional[float] = ...) -> None: ...

class Action(_message.Message):
    __slots__ = ("width", "meaning", "offset_rad", "scale_rad", "low_rad", "high_rad", "clip", "sigma", "servos")
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    MEANING_FIELD_NUMBER: _ClassVar[int]
    OFFSET_RAD_FIELD_NUMBER: _ClassVar[int]
    SCALE_RAD_FIELD_NUMBER: _ClassVar[int]
    LOW_RAD_FIELD_NUMBER: _ClassVar[int]
    HIGH_RAD_FIELD_NUMBER: _ClassVar[int]
    CLIP_FIELD_NUMBER: _ClassVar[int]
    SIGMA_FIELD_NUMBER: _ClassVar[int]
    SERVOS_FIELD_NUMBER: _ClassVar[int]
    width: int
    meaning: str
    offset_rad: _containers.RepeatedScalarFieldContainer[float]
    scale_rad: _containers.RepeatedScalarFieldContainer[float]
    low_rad: _containers.RepeatedScalarFieldContainer[float]
    high_rad: _containers.RepeatedScalarFieldContainer[float]
    clip: float
    sigma: float
    servos: _containers.RepeatedCompositeFieldContainer[Servo]
    def __init__(self, width: _Optional[int] = ..., meaning: _Optional[str] = ..., offset_rad: _Optional[_Iterable[float]] = ..., scale_rad: _Optional[_Iterable[float]] = ..., low_rad: _Optional[_Iterable[float]] = ..., high_rad: _Optional[_Iterable[float]] = ..., clip: _Optional[float] = ..., sigma: _Optional[float] = ..., servos: _Optional[_Iterable[_Union[Servo, _Mapping]]] = ...) -> None: ...

class Servo(_message.Message):
    __slots__ = ("name", "kp", "kd", "limit_nm")
    NAME_FIELD_NUMBER: _ClassVar[int]
    KP_FIELD_NUMBER: _ClassVar[int]
    KD_FIELD_NUMBER: _ClassVar[int]
    LIMIT_NM_FIELD_NUMBER: _ClassVar[int]
    name: str
    kp: float
    kd: float
    limit_nm: float
    def __init__(self, name: _Optional[str] = ..., kp: _Optional[float] = ..., kd: _Optional[float] = ..., limit_nm: _Optional[float] = ...) -> None: ...

class Body(_message.Message):
    __slots__ = ("name", "parent", "offset")
    NAME_FIELD_NUMBER: _ClassVar[int]
    PARENT_FIELD_NUMBER: _ClassVar[int]
    OFFSET_FIELD_NUMBER: _ClassVar[int]
    name: str
    parent: int
    offset: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, name: _Optional[str] = ..., parent: _Optional[int] = ..., offset: _Optional[_Iterable[float]] = ...) -> None: ...

class Joint(_message.Message):
    __slots__ = ("name", "body", "kind", "axis")
    NAME_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    AXIS_FIELD_NUMBER: _ClassVar[int]
    name: str
    body: str
    kind: str
    axis: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, name: _Optional[str] = ..., body: _Optional[str] = ..., kind: _Optional[str] = ..., axis: _Optional[_Iterable[float]] = ...) -> None: ...

class Limits(_message.Message):
    __slots__ = ("max_rows", "max_queued_rows", "max_streams", "max_syntheses", "max_message_bytes", "max_synthesis_s")
    MAX_ROWS_FIELD_NUMBER: _ClassVar[int]
    MAX_QUEUED_ROWS_FIELD_NUMBER: _ClassVar[int]
    MAX_STREAMS_FIELD_NUMBER: _ClassVar[int]
    MAX_SYNTHESES_FIELD_NUMBER: _ClassVar[int]
    MAX_MESSAGE_BYTES_FIELD_NUMBER: _ClassVar[int]
    MAX_SYNTHESIS_S_FIELD_NUMBER: _ClassVar[int]
    max_rows: int
    max_queued_rows: int
    max_streams: int
    max_syntheses: int
    max_message_bytes: int
    max_synthesis_s: float
    def __init__(self, max_rows: _Optional[int] = ..., max_queued_rows: _Optional[int] = ..., max_streams: _Optional[int] = ..., max_syntheses: _Optional[int] = ..., max_message_bytes: _Optional[int] = ..., max_synthesis_s: _Optional[float] = ...) -> None: ...

class ActRequest(_message.Message):
    __slots__ = ("task", "state", "goal", "seed")
    TASK_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    task: str
    state: bytes
    goal: bytes
    seed: int
    def __init__(self, task: _Optional[str] = ..., state: _Optional[bytes] = ..., goal: _Optional[bytes] = ..., seed: _Optional[int] = ...) -> None: ...

class ActReply(_message.Message):
    __slots__ = ("action", "target", "version")
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    action: bytes
    target: bytes
    version: str
    def __init__(self, action: _Optional[bytes] = ..., target: _Optional[bytes] = ..., version: _Optional[str] = ...) -> None: ...

class ActFromPoseRequest(_message.Message):
    __slots__ = ("task", "situations", "seed")
    TASK_FIELD_NUMBER: _ClassVar[int]
    SITUATIONS_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    task: str
    situations: _containers.RepeatedCompositeFieldContainer[Situation]
    seed: int
    def __init__(self, task: _Optional[str] = ..., situations: _Optional[_Iterable[_Union[Situation, _Mapping]]] = ..., seed: _Optional[int] = ...) -> None: ...

class Situation(_message.Message):
    __slots__ = ("pose", "furniture", "box")
    POSE_FIELD_NUMBER: _ClassVar[int]
    FURNITURE_FIELD_NUMBER: _ClassVar[int]
    BOX_FIELD_NUMBER: _ClassVar[int]
    pose: Pose
    furniture: Furniture
    box: CarriedBox
    def __init__(self, pose: _Optional[_Union[Pose, _Mapping]] = ..., furniture: _Optional[_Union[Furniture, _Mapping]] = ..., box: _Optional[_Union[CarriedBox, _Mapping]] = ...) -> None: ...

class Pose(_message.Message):
    __slots__ = ("root_position", "root_rotation", "root_velocity", "root_angular_velocity", "joint_position", "joint_velocity")
    ROOT_POSITION_FIELD_NUMBER: _ClassVar[int]
    ROOT_ROTATION_FIELD_NUMBER: _ClassVar[int]
    ROOT_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    ROOT_ANGULAR_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    JOINT_POSITION_FIELD_NUMBER: _ClassVar[int]
    JOINT_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    root_position: _containers.RepeatedScalarFieldContainer[float]
    root_rotation: _containers.RepeatedScalarFieldContainer[float]
    root_velocity: _containers.RepeatedScalarFieldContainer[float]
    root_angular_velocity: _containers.RepeatedScalarFieldContainer[float]
    joint_position: _containers.RepeatedScalarFieldContainer[float]
    joint_velocity: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, root_position: _Optional[_Iterable[float]] = ..., root_rotation: _Optional[_Iterable[float]] = ..., root_velocity: _Optional[_Iterable[float]] = ..., root_angular_velocity: _Optional[_Iterable[float]] = ..., joint_position: _Optional[_Iterable[float]] = ..., joint_velocity: _Optional[_Iterable[float]] = ...) -> None: ...

class Furniture(_message.Message):
    __slots__ = ("position", "rotation", "piece", "custom", "mesh", "scale", "place")
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    PIECE_FIELD_NUMBER: _ClassVar[int]
    CUSTOM_FIELD_NUMBER: _ClassVar[int]
    MESH_FIELD_NUMBER: _ClassVar[int]
    SCALE_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    position: _containers.RepeatedScalarFieldContainer[float]
    rotation: _containers.RepeatedScalarFieldContainer[float]
    piece: str
    custom: Shape
    mesh: Mesh
    scale: float
    place: int
    def __init__(self, position: _Optional[_Iterable[float]] = ..., rotation: _Optional[_Iterable[float]] = ..., piece: _Optional[str] = ..., custom: _Optional[_Union[Shape, _Mapping]] = ..., mesh: _Optional[_Union[Mesh, _Mapping]] = ..., scale: _Optional[float] = ..., place: _Optional[int] = ...) -> None: ...

class Shape(_message.Message):
    __slots__ = ("low", "high", "hip", "facing_rad", "head", "boxes")
    LOW_FIELD_NUMBER: _ClassVar[int]
    HIGH_FIELD_NUMBER: _ClassVar[int]
    HIP_FIELD_NUMBER: _ClassVar[int]
    FACING_RAD_FIELD_NUMBER: _ClassVar[int]
    HEAD_FIELD_NUMBER: _ClassVar[int]
    BOXES_FIELD_NUMBER: _ClassVar[int]
    low: _containers.RepeatedScalarFieldContainer[float]
    high: _containers.RepeatedScalarFieldContainer[float]
    hip: _containers.RepeatedScalarFieldContainer[float]
    facing_rad: float
    head: _containers.RepeatedScalarFieldContainer[float]
    boxes: _containers.RepeatedCompositeFieldContainer[SolidBox]
    def __init__(self, low: _Optional[_Iterable[float]] = ..., high: _Optional[_Iterable[float]] = ..., hip: _Optional[_Iterable[float]] = ..., facing_rad: _Optional[float] = ..., head: _Optional[_Iterable[float]] = ..., boxes: _Optional[_Iterable[_Union[SolidBox, _Mapping]]] = ...) -> None: ...

class SolidBox(_message.Message):
    __slots__ = ("centre", "half", "rotation")
    CENTRE_FIELD_NUMBER: _ClassVar[int]
    HALF_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    centre: _containers.RepeatedScalarFieldContainer[float]
    half: _containers.RepeatedScalarFieldContainer[float]
    rotation: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, centre: _Optional[_Iterable[float]] = ..., half: _Optional[_Iterable[float]] = ..., rotation: _Optional[_Iterable[float]] = ...) -> None: ...

class Mesh(_message.Message):
    __slots__ = ("format", "data")
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    format: str
    data: bytes
    def __init__(self, format: _Optional[str] = ..., data: _Optional[bytes] = ...) -> None: ...

class CarriedBox(_message.Message):
    __slots__ = ("position", "rotation", "velocity", "size", "start", "goal", "mass_kg")
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    MASS_KG_FIELD_NUMBER: _ClassVar[int]
    position: _containers.RepeatedScalarFieldContainer[float]
    rotation: _containers.RepeatedScalarFieldContainer[float]
    velocity: _containers.RepeatedScalarFieldContainer[float]
    size: _containers.RepeatedScalarFieldContainer[float]
    start: _containers.RepeatedScalarFieldContainer[float]
    goal: _containers.RepeatedScalarFieldContainer[float]
    mass_kg: float
    def __init__(self, position: _Optional[_Iterable[float]] = ..., rotation: _Optional[_Iterable[float]] = ..., velocity: _Optional[_Iterable[float]] = ..., size: _Optional[_Iterable[float]] = ..., start: _Optional[_Iterable[float]] = ..., goal: _Optional[_Iterable[float]] = ..., mass_kg: _Optional[float] = ...) -> None: ...

class ControlRequest(_message.Message):
    __slots__ = ("task", "sequence", "observation", "situation", "seed")
    TASK_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    OBSERVATION_FIELD_NUMBER: _ClassVar[int]
    SITUATION_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    task: str
    sequence: int
    observation: Observation
    situation: Situation
    seed: int
    def __init__(self, task: _Optional[str] = ..., sequence: _Optional[int] = ..., observation: _Optional[_Union[Observation, _Mapping]] = ..., situation: _Optional[_Union[Situation, _Mapping]] = ..., seed: _Optional[int] = ...) -> None: ...

class Observation(_message.Message):
    __slots__ = ("state", "goal")
    STATE_FIELD_NUMBER: _ClassVar[int]
    GOAL_FIELD_NUMBER: _ClassVar[int]
    state: bytes
    goal: bytes
    def __init__(self, state: _Optional[bytes] = ..., goal: _Optional[bytes] = ...) -> None: ...

class ControlReply(_message.Message):
    __slots__ = ("sequence", "action", "target", "version", "dropped")
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    DROPPED_FIELD_NUMBER: _ClassVar[int]
    sequence: int
    action: bytes
    target: bytes
    version: str
    dropped: int
    def __init__(self, sequence: _Optional[int] = ..., action: _Optional[bytes] = ..., target: _Optional[bytes] = ..., version: _Optional[str] = ..., dropped: _Optional[int] = ...) -> None: ...

class SynthesizeRequest(_message.Message):
    __slots__ = ("task", "furniture", "box", "start", "seconds", "seed", "pushes", "moves", "to_the_end", "bodies", "projectiles", "displacement")
    TASK_FIELD_NUMBER: _ClassVar[int]
    FURNITURE_FIELD_NUMBER: _ClassVar[int]
    BOX_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    PUSHES_FIELD_NUMBER: _ClassVar[int]
    MOVES_FIELD_NUMBER: _ClassVar[int]
    TO_THE_END_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    PROJECTILES_FIELD_NUMBER: _ClassVar[int]
    DISPLACEMENT_FIELD_NUMBER: _ClassVar[int]
    task: str
    furniture: Furniture
    box: CarriedBox
    start: Start
    seconds: float
    seed: int
    pushes: _containers.RepeatedCompositeFieldContainer[Push]
    moves: _containers.RepeatedCompositeFieldContainer[Move]
    to_the_end: bool
    bodies: bool
    projectiles: Projectiles
    displacement: Displacement
    def __init__(self, task: _Optional[str] = ..., furniture: _Optional[_Union[Furniture, _Mapping]] = ..., box: _Optional[_Union[CarriedBox, _Mapping]] = ..., start: _Optional[_Union[Start, _Mapping]] = ..., seconds: _Optional[float] = ..., seed: _Optional[int] = ..., pushes: _Optional[_Iterable[_Union[Push, _Mapping]]] = ..., moves: _Optional[_Iterable[_Union[Move, _Mapping]]] = ..., to_the_end: _Optional[bool] = ..., bodies: _Optional[bool] = ..., projectiles: _Optional[_Union[Projectiles, _Mapping]] = ..., displacement: _Optional[_Union[Displacement, _Mapping]] = ...) -> None: ...

class Start(_message.Message):
    __slots__ = ("standing", "pose")
    STANDING_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    standing: Stance
    pose: Pose
    def __init__(self, standing: _Optional[_Union[Stance, _Mapping]] = ..., pose: _Optional[_Union[Pose, _Mapping]] = ...) -> None: ...

class Stance(_message.Message):
    __slots__ = ("x", "y", "yaw_rad")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    YAW_RAD_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    yaw_rad: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., yaw_rad: _Optional[float] = ...) -> None: ...

class Push(_message.Message):
    __slots__ = ("at_s", "seconds", "body", "force")
    AT_S_FIELD_NUMBER: _ClassVar[int]
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    at_s: float
    seconds: float
    body: str
    force: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, at_s: _Optional[float] = ..., seconds: _Optional[float] = ..., body: _Optional[str] = ..., force: _Optional[_Iterable[float]] = ...) -> None: ...

class Move(_message.Message):
    __slots__ = ("at_s", "position", "rotation")
    AT_S_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    at_s: float
    position: _containers.RepeatedScalarFieldContainer[float]
    rotation: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, at_s: _Optional[float] = ..., position: _Optional[_Iterable[float]] = ..., rotation: _Optional[_Iterable[float]] = ...) -> None: ...

class Projectiles(_message.Message):
    __slots__ = ("seed", "count", "mass_kg", "radius_m", "speed_m_s")
    SEED_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    MASS_KG_FIELD_NUMBER: _ClassVar[int]
    RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    SPEED_M_S_FIELD_NUMBER: _ClassVar[int]
    seed: int
    count: int
    mass_kg: float
    radius_m: float
    speed_m_s: float
    def __init__(self, seed: _Optional[int] = ..., count: _Optional[int] = ..., mass_kg: _Optional[float] = ..., radius_m: _Optional[float] = ..., speed_m_s: _Optional[float] = ...) -> None: ...

class Displacement(_message.Message):
    __slots__ = ("seed", "near_m", "shift_m")
    SEED_FIELD_NUMBER: _ClassVar[int]
    NEAR_M_FIELD_NUMBER: _ClassVar[int]
    SHIFT_M_FIELD_NUMBER: _ClassVar[int]
    seed: int
    near_m: float
    shift_m: float
    def __init__(self, seed: _Optional[int] = ..., near_m: _Optional[float] = ..., shift_m: _Optional[float] = ...) -> None: ...

class SynthesizeReply(_message.Message):
    __slots__ = ("header", "frame", "summary")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    header: SynthesisHeader
    frame: Frame
    summary: SynthesisSummary
    def __init__(self, header: _Optional[_Union[SynthesisHeader, _Mapping]] = ..., frame: _Optional[_Union[Frame, _Mapping]] = ..., summary: _Optional[_Union[SynthesisSummary, _Mapping]] = ...) -> None: ...

class SynthesisHeader(_message.Message):
    __slots__ = ("task", "version", "control_hz", "bodies", "joints", "reward_terms", "boxes", "style", "ball_radius_m")
    TASK_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    CONTROL_HZ_FIELD_NUMBER: _ClassVar[int]
    BODIES_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    REWARD_TERMS_FIELD_NUMBER: _ClassVar[int]
    BOXES_FIELD_NUMBER: _ClassVar[int]
    STYLE_FIELD_NUMBER: _ClassVar[int]
    BALL_RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    task: str
    version: str
    control_hz: float
    bodies: _containers.RepeatedCompositeFieldContainer[Body]
    joints: _containers.RepeatedCompositeFieldContainer[Joint]
    reward_terms: _containers.RepeatedScalarFieldContainer[str]
    boxes: _containers.RepeatedCompositeFieldContainer[SolidBox]
    style: bool
    ball_radius_m: float
    def __init__(self, task: _Optional[str] = ..., version: _Optional[str] = ..., control_hz: _Optional[float] = ..., bodies: _Optional[_Iterable[_Union[Body, _Mapping]]] = ..., joints: _Optional[_Iterable[_Union[Joint, _Mapping]]] = ..., reward_terms: _Optional[_Iterable[str]] = ..., boxes: _Optional[_Iterable[_Union[SolidBox, _Mapping]]] = ..., style: _Optional[bool] = ..., ball_radius_m: _Optional[float] = ...) -> None: ...

class Frame(_message.Message):
    __slots__ = ("time_s", "root_position", "root_rotation", "joint_position", "joint_velocity", "object_position", "object_rotation", "body_position", "body_rotation", "style_score", "reward_terms", "reward", "error_m", "success", "fell", "balls")
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    ROOT_POSITION_FIELD_NUMBER: _ClassVar[int]
    ROOT_ROTATION_FIELD_NUMBER: _ClassVar[int]
    JOINT_POSITION_FIELD_NUMBER: _ClassVar[int]
    JOINT_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    OBJECT_POSITION_FIELD_NUMBER: _ClassVar[int]
    OBJECT_ROTATION_FIELD_NUMBER: _ClassVar[int]
    BODY_POSITION_FIELD_NUMBER: _ClassVar[int]
    BODY_ROTATION_FIELD_NUMBER: _ClassVar[int]
    STYLE_SCORE_FIELD_NUMBER: _ClassVar[int]
    REWARD_TERMS_FIELD_NUMBER: _ClassVar[int]
    REWARD_FIELD_NUMBER: _ClassVar[int]
    ERROR_M_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_FIELD_NUMBER: _ClassVar[int]
    FELL_FIELD_NUMBER: _ClassVar[int]
    BALLS_FIELD_NUMBER: _ClassVar[int]
    time_s: float
    root_position: _containers.RepeatedScalarFieldContainer[float]
    root_rotation: _containers.RepeatedScalarFieldContainer[float]
    joint_position: _containers.RepeatedScalarFieldContainer[float]
    joint_velocity: _containers.RepeatedScalarFieldContainer[float]
    object_position: _containers.RepeatedScalarFieldContainer[float]
    object_rotation: _containers.RepeatedScalarFieldContainer[float]
    body_position: _containers.RepeatedScalarFieldContainer[float]
    body_rotation: _containers.RepeatedScalarFieldContainer[float]
    style_score: float
    reward_terms: _containers.RepeatedScalarFieldContainer[float]
    reward: float
    error_m: float
    success: bool
    fell: bool
    balls: _containers.RepeatedCompositeFieldContainer[Ball]
    def __init__(self, time_s: _Optional[float] = ..., root_position: _Optional[_Iterable[float]] = ..., root_rotation: _Optional[_Iterable[float]] = ..., joint_position: _Optional[_Iterable[float]] = ..., joint_velocity: _Optional[_Iterable[float]] = ..., object_position: _Optional[_Iterable[float]] = ..., object_rotation: _Optional[_Iterable[float]] = ..., body_position: _Optional[_Iterable[float]] = ..., body_rotation: _Optional[_Iterable[float]] = ..., style_score: _Optional[float] = ..., reward_terms: _Optional[_Iterable[float]] = ..., reward: _Optional[float] = ..., error_m: _Optional[float] = ..., success: _Optional[bool] = ..., fell: _Optional[bool] = ..., balls: _Optional[_Iterable[_Union[Ball, _Mapping]]] = ...) -> None: ...

class Ball(_message.Message):
    __slots__ = ("number", "position")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    number: int
    position: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, number: _Optional[int] = ..., position: _Optional[_Iterable[float]] = ...) -> None: ...

class SynthesisSummary(_message.Message):
    __slots__ = ("frames", "success", "fell", "success_s", "precision_m", "balls_thrown", "displaced")
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_FIELD_NUMBER: _ClassVar[int]
    FELL_FIELD_NUMBER: _ClassVar[int]
    SUCCESS_S_FIELD_NUMBER: _ClassVar[int]
    PRECISION_M_FIELD_NUMBER: _ClassVar[int]
    BALLS_THROWN_FIELD_NUMBER: _ClassVar[int]
    DISPLACED_FIELD_NUMBER: _ClassVar[int]
    frames: int
    success: bool
    fell: bool
    success_s: float
    precision_m: float
    balls_thrown: int
    displaced: bool
    def __init__(self, frames: _Optional[int] = ..., success: _Optional[bool] = ..., fell: _Optional[bool] = ..., success_s: _Optional[float] = ..., precision_m: _Optional[float] = ..., balls_thrown: _Optional[int] = ..., displaced: _Optional[bool] = ...) -> None: ...
