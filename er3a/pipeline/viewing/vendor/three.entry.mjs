export {
  BackSide, BoxGeometry, BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, DecrementWrapStencilOp, DirectionalLight,
  DoubleSide, Float32BufferAttribute, FrontSide, Group, HemisphereLight, IncrementWrapStencilOp, Matrix4, Mesh,
  MeshStandardMaterial, NotEqualStencilFunc, PerspectiveCamera, Plane, PlaneGeometry, Points, PointsMaterial, Raycaster,
  ReplaceStencilOp, Scene, ShadowMaterial, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
export { LineMaterial } from "three/addons/lines/LineMaterial.js";
export { LineSegments2 } from "three/addons/lines/LineSegments2.js";
export { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
export { toCreasedNormals } from "three/addons/utils/BufferGeometryUtils.js";
