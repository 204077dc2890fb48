"""The types of the scene format. Written by apps/python/reference/stubs.py from the descriptors; do not edit."""
from typing import Any, Dict, List, Sequence, Union

from numpy.typing import NDArray

Json = Dict[str, Any]
Number = Union[float, str]
Numbers = Union[float, str, Sequence[Number], NDArray[Any]]
Axis = Union[str, Sequence[float], NDArray[Any]]
End = Union[str, Json]

class _Joint:
    def fixed(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., at: Numbers = ..., rotation: Any = ...) -> Json:
        """no motion: the body is one rigid part with its parent"""
    def revolute(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., at: Numbers = ..., rotation: Any = ...,
        position: Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """rotation about an axis"""
    def prismatic(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., at: Numbers = ..., rotation: Any = ...,
        position: Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """translation along an axis"""
    def screw(self, *, pitch: Number, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., at: Numbers = ..., rotation: Any =
        ..., position: Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """rotation about an axis, and translation along it in proportion"""
    def cylindrical(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., at: Numbers = ..., rotation: Any = ...,
        position: Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """rotation about an axis and translation along it"""
    def planar(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., at: Numbers = ..., rotation: Any = ..., position:
        Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """translations in a plane and a rotation about its normal"""
    def universal(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., axis: Axis = ..., axis2: Axis = ..., at: Numbers = ...,
        rotation: Any = ..., position: Union[Numbers, Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """rotation about an axis, then about a second one: Cardan joint"""
    def spherical(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., at: Numbers = ..., rotation: Any = ..., position: Union[Numbers,
        Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """every rotation about the origin of the joint frame"""
    def free(self, *, name: str = ..., guess: Numbers = ..., limits: Json = ..., at: Numbers = ..., rotation: Any = ..., position: Union[Numbers,
        Json] = ..., velocity: Union[Numbers, Json] = ..., armature: Numbers = ...) -> Json:
        """all six degrees of freedom"""
    def __dir__(self) -> List[str]: ...

joint: _Joint

class _Loop:
    def spherical(self, *, between: Sequence[End], name: str = ..., switched: bool = ...) -> Json:
        """the two points coincide"""
    def inline(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """the second point stays on a line through the first"""
    def inplane(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """the second point stays in a plane through the first"""
    def distance(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., slack: Union[bool, str] = False, restitution: Number = 0.0,
        rest_velocity: Number = 1e-06, poisson: Union[bool, str] = False, length: Union[Number, Json] = ...) -> Json:
        """the two points keep a distance"""
    def parallel(self, *, between: Sequence[End], name: str = ..., switched: bool = ...) -> Json:
        """both ends have the same orientation"""
    def coaxial(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """the axes of both ends are parallel"""
    def orthogonal(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis = ...) -> Json:
        """the axes of both ends are at right angles"""
    def revolute(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """a rotation about the axis is left free"""
    def prismatic(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """a translation along the axis is left free"""
    def screw(self, *, between: Sequence[End], pitch: Number, name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """a rotation about the axis, and a translation along it in proportion, are left free"""
    def cylindrical(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """a rotation about the axis and a translation along it are left free"""
    def planar(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """translations in a plane and a rotation about its normal are left free"""
    def weld(self, *, between: Sequence[End], name: str = ..., switched: bool = ...) -> Json:
        """both ends are one rigid part"""
    def universal(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis = ...) -> Json:
        """Cardan joint: rotations about an axis of either end are left free"""
    def coupling(self, *, name: str = ..., switched: bool = ..., coefficients: Any = ..., formula: Number = ..., offset: Number = 0.0) -> Json:
        """a relation of joint positions: gears, pulleys, joints that follow others; with a formula, cams"""
    def motion(self, *, joint: str, position: Union[Number, Json], name: str = ..., switched: bool = ...) -> Json:
        """the position of a joint is a function of time"""
    def rolling(self, *, wheel: End, radius: Number, on: End, name: str = ..., switched: bool = ..., axis: Axis = ..., normal: Axis = ..., holonomic:
        Union[bool, str] = ...) -> Json:
        """a wheel rolls on a plane without slip"""
    def knife_edge(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """the second point does not move sideways: an ice skate"""
    def rates(self, *, coefficients: Any, name: str = ..., switched: bool = ..., rate: Union[Number, Json] = ...) -> Json:
        """a linear relation of joint rates: a given speed, friction wheels, differentials"""
    def homokinetic(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """constant-velocity joint: two shafts turn alike at any angle between them"""
    def surface(self, *, between: Sequence[End], surface: Any, name: str = ..., switched: bool = ..., axis: Axis = ...) -> Json:
        """the second point stays on a surface"""
    def curve(self, *, between: Sequence[End], curve: Any, name: str = ..., switched: bool = ..., axis: Axis = ..., distance: Union[Number, Json] =
        ...) -> Json:
        """the second point stays on a curve; its arc length may be given"""
    def gear(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis = ..., radius: Number = ...,
        radius2: Number = ..., teeth: Number = ..., teeth2: Number = ..., module: Number = ..., pressure_angle: Number = ..., helix_angle: Number =
        0.0) -> Json:
        """two toothed wheels mesh, with parallel or intersecting axes; the bearings carry the force of the teeth"""
    def rack(self, *, between: Sequence[End], radius: Number, name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis = ...,
        pressure_angle: Number = ...) -> Json:
        """a toothed wheel meshes with a rack; bearings and guides carry the force of the teeth"""
    def worm(self, *, between: Sequence[End], radius: Number, teeth: Number, teeth2: Number, name: str = ..., switched: bool = ..., axis: Axis = ...,
        axis2: Axis = ..., pressure_angle: Number = ...) -> Json:
        """a worm drives a wheel whose axis is at a right angle; the bearings carry the force of the teeth"""
    def span(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis = ..., radius: Number = 0.0,
        radius2: Number = 0.0, tension: Number = 0.0, slack: Union[bool, str] = False, restitution: Number = 0.0, rest_velocity: Number = 1e-06,
        poisson: Union[bool, str] = False) -> Json:
        """a rope runs straight from one pulley to another without slip; bearings carry its tension"""
    def belt(self, *, between: Sequence[End], radius: Number, radius2: Number, name: str = ..., switched: bool = ..., axis: Axis = ..., axis2: Axis =
        ..., crossed: Union[bool, str] = False, tension: Number = 0.0) -> Json:
        """a belt runs around two pulleys without slip; the bearings carry both spans"""
    def __dir__(self) -> List[str]: ...

loop: _Loop

class _Effect:
    def spring(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., stiffness: Number = 0.0, length: Number = ..., damping: Number
        = 0.0) -> Json:
        """a spring and a damper along the line between two points"""
    def joint_spring(self, *, joint: str, name: str = ..., switched: bool = ..., stiffness: Number = 0.0, rest: Union[Number, Json] = ..., damping:
        Number = 0.0) -> Json:
        """a spring and a damper in a joint"""
    def joint_damper(self, *, joint: str, damping: Number, name: str = ..., switched: bool = ...) -> Json:
        """a linear damper in a joint"""
    def joint_friction(self, *, joint: str, name: str = ..., switched: bool = ..., coulomb: Number = 0.0, coefficient: Number = 0.0, radius: Number =
        0.0, efficiency: Number = 1.0, load: str = ..., viscous: Number = 0.0, static: Number = ..., stribeck: Number = 0.01, smoothing: Number =
        0.001, stick: Union[bool, str] = False) -> Json:
        """dry and viscous friction in a joint, with Stribeck's curve"""
    def joint_limit(self, *, joint: str, name: str = ..., switched: bool = ..., lower: Number = ..., upper: Number = ..., stiffness: Number = 0.0,
        damping: Number = 0.0, restitution: Number = ..., rest_velocity: Number = 1e-06, poisson: Union[bool, str] = False) -> Json:
        """elastic or hard stops of a joint"""
    def bushing(self, *, between: Sequence[End], name: str = ..., switched: bool = ..., stiffness: Numbers = ..., damping: Numbers = ...) -> Json:
        """springs and dampers in all six directions between two frames"""
    def motor(self, *, joint: str, torque: Union[Number, Json], name: str = ..., switched: bool = ..., force: Union[Number, Json] = ...) -> Json:
        """a torque or force in a joint as a function of time"""
    def servo(self, *, joint: str, target: Union[Number, Json], name: str = ..., switched: bool = ..., stiffness: Number = 0.0, damping: Number = 0.0,
        limit: Number = ..., lower: Number = ..., upper: Number = ...) -> Json:
        """a drive that follows a target position in a joint, with a limited force"""
    def force(self, *, at: End, value: Any, name: str = ..., switched: bool = ..., frame: str = ...) -> Json:
        """a force on a point of a body"""
    def torque(self, *, on: End, value: Any, name: str = ..., switched: bool = ..., frame: str = ...) -> Json:
        """a torque on a body"""
    def drag(self, *, on: str, name: str = ..., switched: bool = ..., at: Union[str, Numbers] = ..., linear: Number = 0.0, quadratic: Number = 0.0,
        axes_linear: Numbers = ..., axes_quadratic: Numbers = ...) -> Json:
        """resistance of a medium at rest to the motion of a point, or to a body along its axes"""
    def attraction(self, *, between: Sequence[End], strength: Number, name: str = ..., switched: bool = ...) -> Json:
        """attraction of two points by the inverse square of their distance"""
    def contact(self, *, point: End, plane: End, name: str = ..., switched: bool = ..., radius: Number = 0.0, axle: Axis = ..., radius2: Number = ...,
        axis: Axis = ..., stiffness: Number = 0.0, exponent: Number = 1.5, dissipation: Number = 0.0, friction: Number = 0.0, slip: Number = 0.001,
        rolling: Number = 0.0, torsion: Number = 0.0, turn: Number = 0.01, restitution: Number = ..., rest_velocity: Number = 1e-06, poisson:
        Union[bool, str] = False) -> Json:
        """contact of a sphere or a disc with a half-space (Hunt and Crossley), with friction"""
    def expression(self, *, name: str = ..., switched: bool = ..., joint: str = ..., between: Sequence[End] = ..., path: Any = ..., at: End = ...,
        force: Union[Number, Sequence[Number]] = ..., torque: Union[Number, Sequence[Number]] = ..., actuators: Any = ..., lower: Any = ..., upper:
        Any = ..., spring: Any = ..., frame: str = ...) -> Json:
        """a force by formulas of t, parameters and the motion of joints and markers"""
    def thrust(self, *, at: End, mass: Union[Number, Json], exhaust: Numbers, name: str = ..., switched: bool = ...) -> Json:
        """thrust of mass that leaves or arrives"""
    def __dir__(self) -> List[str]: ...

effect: _Effect

class _Shape:
    def point(self, *, at: Numbers = ...) -> Json:
        """a point mass"""
    def rod(self, *, to: Numbers, radius: Number = 0.0, **others: Any) -> Json:
        """a rod between two points"""
    def box(self, *, size: Numbers, at: Numbers = ..., rotation: Any = ...) -> Json:
        """a box with edges along its axes"""
    def sphere(self, *, radius: Number, at: Numbers = ..., rotation: Any = ...) -> Json:
        """a ball"""
    def cylinder(self, *, radius: Number, length: Number, axis: Axis = ..., at: Numbers = ..., rotation: Any = ...) -> Json:
        """a cylinder about its axis"""
    def polygon(self, *, points: Any, thickness: Number, at: Numbers = ..., rotation: Any = ...) -> Json:
        """a plate of any outline"""
    def __dir__(self) -> List[str]: ...

shape: _Shape
