// Reads Kubernetes objects, YAML on standard input, and prints a line for each fault: values of wrong types and missing
// fields, by kubernetes-models, names that no type has, by the tables of @kubernetes/client-node, and what the pod
// security standard "restricted" forbids. Then one with the number of objects. With the argument KIND it prints instead
// the words of the command in that object's pod, one a line. The packages are in the folder that NODE_FOLDER names.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const require = createRequire(`${process.env.NODE_FOLDER}/`);
const load = async (name) => import(pathToFileURL(require.resolve(name)));
const folder = `${process.env.NODE_FOLDER}/node_modules`;
const yaml = await load("yaml");
const client = await import(`${folder}/@kubernetes/client-node/dist/index.js`);

// strangers VALUE TYPE PATH: names in the value that its type, as the tables write it, has not.
function strangers(value, type, path) {
    const list = /^Array<(.*)>$/.exec(type);
    const map = /^\{ \[key: string\]: (.*); \}$/.exec(type);
    if (list && !Array.isArray(value)) return [`${path}: expected a list`];
    if (list) return value.flatMap((item, i) => strangers(item, list[1], `${path}[${i}]`));
    if (map) return Object.entries(value).flatMap(([key, item]) => strangers(item, map[1], `${path}.${key}`));
    const table = client[type]?.getAttributeTypeMap?.();
    if (!table || typeof value !== "object") return [];
    return Object.entries(value).flatMap(([key, item]) => {
        const field = table.find(({ baseName }) => baseName === key);
        return field ? strangers(item, field.type, `${path}.${key}`) : [`${path}: ${type} has no field "${key}"`];
    });
}

// forbidden OBJECT: what the standard (kubernetes.io/docs/concepts/security/pod-security-standards) asks for and its pod
// has otherwise.
function forbidden(object) {
    const pod = object.kind === "Pod" ? object.spec : object.spec?.template?.spec;
    if (!pod) return [];
    const kinds = ["configMap", "downwardAPI", "emptyDir", "ephemeral", "persistentVolumeClaim", "projected", "secret"];
    const rules = [
        ["host namespaces", !pod.hostNetwork && !pod.hostPID && !pod.hostIPC],
        ["kinds of volumes", (pod.volumes ?? []).every((volume) => kinds.some((kind) => volume[kind]))],
        ["runAsNonRoot", pod.securityContext?.runAsNonRoot === true],
        ["runAsUser", pod.securityContext?.runAsUser > 0],
        ["seccompProfile", pod.securityContext?.seccompProfile?.type === "RuntimeDefault"],
        ...[...pod.containers, ...(pod.initContainers ?? [])].flatMap(({ name, securityContext, ports }) => [
            [`${name}: allowPrivilegeEscalation`, securityContext?.allowPrivilegeEscalation === false],
            [`${name}: capabilities`, securityContext?.capabilities?.drop?.includes("ALL")],
            [`${name}: added capabilities`, !securityContext?.capabilities?.add],
            [`${name}: privileged`, !securityContext?.privileged],
            [`${name}: hostPort`, !(ports ?? []).some(({ hostPort }) => hostPort)],
        ]),
    ];
    const broken = rules.filter(([, kept]) => !kept);
    return broken.map(([rule]) => `${object.kind} ${object.metadata.name}: not restricted: ${rule}`);
}

async function faults(object) {
    const path = `${object.kind} ${object.metadata?.name}`;
    const version = object.apiVersion;
    const found = [];
    try {
        const models = await import(`${folder}/kubernetes-models/${version}/${object.kind}.js`);
        new models[object.kind](object).validate();
    } catch (error) {
        found.push(`${path}: ${error.message}`);
    }
    const type = version.split("/").pop().replace(/^v/, "V") + object.kind;
    if (!client[type]) return [...found, `${path}: no type ${type}`];
    return [...found, ...strangers(object, type, path), ...forbidden(object)];
}

const objects = yaml.parseAllDocuments(readFileSync(0, "utf8")).map((document) => document.toJS());
const kind = process.argv[2];
if (kind) {
    console.log(objects.find((object) => object.kind === kind).spec.template.spec.containers[0].command.join("\n"));
} else {
    for (const object of objects) for (const fault of await faults(object)) console.log(fault);
    console.log(`${objects.length} objects`);
}
