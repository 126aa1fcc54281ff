#!/usr/bin/env bash
# three 0.187.0 (three.js) draws an InstancedMesh at each of its instances' places. Its exporters to PLY, OBJ and STL write the mesh
# once, at the place of none of them, without a word; its exporter to glTF writes the instances (EXT_mesh_gpu_instancing). Things
# that are invisible, as those that are hidden to look behind them, are in PLY, OBJ and STL, and not in glTF.
#
# Guess before it was run: what is written is what is drawn: each instance, and nothing that is invisible (noted after a first odd
# output).
# For whom it matters: whoever exports a scene of a web viewer or a digital twin to register scans with: racks, columns, seats or trees
# are all missing but one, which stands at the origin, where nothing is. Make a mesh of each instance first, and take hidden ones out.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
HOME="$folder" npm install --silent --no-fund --no-audit --prefix "$folder" "three@0.187.0" >/dev/null
cat >show.mjs <<'JAVASCRIPT'
import assert from 'node:assert/strict';
import * as THREE from 'three';
import { GLTFExporter } from 'three/examples/jsm/exporters/GLTFExporter.js';
import { OBJExporter } from 'three/examples/jsm/exporters/OBJExporter.js';
import { PLYExporter } from 'three/examples/jsm/exporters/PLYExporter.js';
import { STLExporter } from 'three/examples/jsm/exporters/STLExporter.js';

globalThis.requestAnimationFrame = (then) => setTimeout(then, 0); // browsers have it
globalThis.FileReader = class {
  readAsDataURL(blob) {
    blob.arrayBuffer().then((bytes) => {
      this.result = 'data:;base64,' + Buffer.from(bytes).toString('base64');
      this.onloadend();
    });
  }
};

const along = (rows) => rows.map((row) => Number(row[0]));
const ranges = {
  PLY: (scene) => {
    const [head, body] = new PLYExporter().parse(scene, () => {}, {}).split('end_header\n');
    return along(body.split('\n').slice(0, Number(/element vertex (\d+)/.exec(head)[1])).map((line) => line.split(' ')));
  },
  OBJ: (scene) => along([...new OBJExporter().parse(scene).matchAll(/^v (\S+)/gm)].map((found) => [found[1]])),
  STL: (scene) => along([...new STLExporter().parse(scene).matchAll(/vertex (\S+)/g)].map((found) => [found[1]])),
};

const racks = new THREE.InstancedMesh(new THREE.BoxGeometry(1, 2, 1), new THREE.MeshBasicMaterial(), 6);
for (let k = 0; k < 6; k++) racks.setMatrixAt(k, new THREE.Matrix4().makeTranslation(10 + 3 * k, 0, 0));
const hidden = new THREE.Mesh(new THREE.BoxGeometry(), new THREE.MeshBasicMaterial());
hidden.position.x = 50;
hidden.visible = false;
const scenes = { 'six racks, x from 9.5 to 25.5': racks, 'a thing that is hidden, x from 49.5 to 50.5': hidden };

console.log('three', THREE.REVISION, 'node', process.version);
for (const [words, thing] of Object.entries(scenes)) {
  const scene = new THREE.Scene().add(thing);
  scene.updateMatrixWorld(true);
  console.log(' ', words);
  for (const [format, places] of Object.entries(ranges)) {
    const x = places(scene);
    console.log(`    ${format}: x from ${Math.min(...x)} to ${Math.max(...x)}`);
    const [low, high] = thing === racks ? [-0.5, 0.5] : [49.5, 50.5];
    assert.deepEqual([Math.min(...x), Math.max(...x)], [low, high], 'three no longer does this');
  }
  const gltf = await new GLTFExporter().parseAsync(scene, {});
  const written = (gltf.extensionsUsed ?? []).includes('EXT_mesh_gpu_instancing') ? 'instances' : (gltf.meshes ?? []).length;
  console.log(`    glTF: ${written === 'instances' ? 'its instances' : `${written} meshes`}`);
  assert.equal(written, thing === racks ? 'instances' : 0, 'three no longer does this');
}
console.log('one of six racks is left, at the origin; what was hidden is there');
JAVASCRIPT
node show.mjs
