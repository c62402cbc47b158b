// SPDX-License-Identifier: GPL-3.0-or-later
// Shader text to program: finds the embedded text (or the file under PATINA_SHADER_DIR, for live editing), resolves
// #include "..." relative to shaders/, each file once, and tells errors by file and line.
#include "device_gl.h"
#include "shaders.h"
#include "base/words.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Lines are numbered across files: #line's second number, which file it is, Mesa forgets of what it finds behind the syntax.
enum { MAX_FILES = 32, MAX_NAME = 64, LOG_SIZE = 4096, LINES_A_FILE = 10000 };

struct source {
    char *text;
    const char *body; // what #include "BODY" stands for; NULL: nothing
    size_t length, capacity;
    char files[MAX_FILES][MAX_NAME]; // lines of file i are numbered from LINES_A_FILE i on
    unsigned file_count;
};

static int append(struct source *s, const char *text, size_t length)
{
    if (s->length + length + 1 > s->capacity) {
        size_t capacity = 2 * s->capacity + length + 4096;
        char *grown = realloc(s->text, capacity);
        if (!grown)
            return PATINA_ERROR_MEMORY;
        s->text = grown;
        s->capacity = capacity;
    }
    memcpy(s->text + s->length, text, length);
    s->length += length;
    s->text[s->length] = 0;
    return PATINA_OK;
}

static int append_line_number(struct source *s, unsigned line, unsigned file)
{
    char text[48];
    int length = snprintf(text, sizeof text, "#line %u\n", LINES_A_FILE * file + line);
    return append(s, text, (size_t)length);
}

// The text of a shader file; to be freed.
static char *find_text(const char *name)
{
    const char *folder = getenv("PATINA_SHADER_DIR");
    if (folder && *folder) {
        char path[4096];
        int length = snprintf(path, sizeof path, "%s/%s", folder, name);
        FILE *file = length > 0 && (size_t)length < sizeof path ? pt_stream_open(path, "rb") : NULL;
        if (file) {
            char *text = calloc(1, 1 << 20);
            size_t size = text ? fread(text, 1, (1 << 20) - 1, file) : 0;
            fclose(file);
            if (text)
                text[size] = 0;
            return text;
        }
    }
    for (const struct pt_embedded_shader *s = pt_embedded_shaders; s->name; s++)
        if (!strcmp(s->name, name))
            return pt_copy_text(s->text, strlen(s->text));
    return NULL;
}

// `struct NAME member;` is C; GLSL wants `NAME member;`. Only the definition, `struct NAME {`, keeps the word.
static const char *without_struct(const char *line, const char *end)
{
    const char *at = line;
    while (at < end && isspace((unsigned char)*at))
        at++;
    if (end - at < 7 || strncmp(at, "struct ", 7) || memchr(at, '{', (size_t)(end - at)))
        return line;
    return at + 7;
}

static int add_file(struct pt_gl_device *d, struct source *s, const char *name, const char *definitions);

// #include "lib/math.glsl": once. #include <...> is C's and stands in a part that GLSL skips: left out.
static int include(struct pt_gl_device *d, struct source *s, const char *line, const char *end)
{
    char name[MAX_NAME];
    const char *open = memchr(line, '"', (size_t)(end - line));
    const char *close = open ? memchr(open + 1, '"', (size_t)(end - open - 1)) : NULL;
    if (!close || close - open - 1 >= MAX_NAME)
        return PATINA_OK;
    snprintf(name, sizeof name, "%.*s", (int)(close - open - 1), open + 1);
    if (s->body && !strcmp(name, "BODY"))
        snprintf(name, sizeof name, "%s", s->body);
    for (unsigned i = 0; i < s->file_count; i++)
        if (!strcmp(s->files[i], name))
            return PATINA_OK;
    return add_file(d, s, name, NULL);
}

// definitions: put behind the #version line of the kernel itself.
static int add_file(struct pt_gl_device *d, struct source *s, const char *name, const char *definitions)
{
    if (s->file_count == MAX_FILES || strlen(name) >= MAX_NAME)
        return pt_gl_fail(d, PATINA_ERROR_INTERNAL, "shader %s: too many files", name);
    char *text = find_text(name);
    if (!text)
        return pt_gl_fail(d, PATINA_ERROR_DEVICE, "shader %s is missing", name);
    unsigned file = s->file_count++, number = 1;
    snprintf(s->files[file], MAX_NAME, "%s", name);
    int result = definitions ? PATINA_OK : append_line_number(s, 1, file);
    for (const char *line = text, *end; *line && result == PATINA_OK; line = *end ? end + 1 : end, number++) {
        end = strchr(line, '\n');
        if (!end)
            end = line + strlen(line);
        if (!strncmp(line, "#include", 8)) {
            result = include(d, s, line, end);
            if (result == PATINA_OK)
                result = append_line_number(s, number + 1, file);
            continue;
        }
        const char *from = without_struct(line, end);
        result = append(s, from, (size_t)(end - from));
        if (result == PATINA_OK)
            result = append(s, "\n", 1);
        if (result == PATINA_OK && definitions && !strncmp(line, "#version", 8)) {
            result = append(s, definitions, strlen(definitions));
            if (result == PATINA_OK)
                result = append_line_number(s, number + 1, file);
        }
    }
    free(text);
    if (result == PATINA_ERROR_MEMORY)
        pt_gl_fail(d, result, "out of memory");
    return result;
}

// Drivers write "0:12(3): error: ..." (Mesa, Intel), "0(12) : error ..." (NVIDIA) or "ERROR: 0:12: ..." (AMD).
static int fail_with_log(struct pt_gl_device *d, const struct source *s, char *log)
{
    unsigned shader, line;
    int after = 0;
    char *text = strstr(log, "error"); // warnings may come first
    text = text ? text : strstr(log, "ERROR");
    text = text ? text : log;
    while (text > log && text[-1] != '\n')
        text--;
    text[strcspn(text, "\n")] = 0;
    text += strncmp(text, "ERROR: ", 7) ? 0 : 7;
    if ((sscanf(text, "%u:%u%n", &shader, &line, &after) == 2 || sscanf(text, "%u(%u%n", &shader, &line, &after) == 2) &&
        line / LINES_A_FILE < s->file_count)
        return pt_gl_fail(d, PATINA_ERROR_DEVICE, "shaders/%s:%u: %s", s->files[line / LINES_A_FILE], line % LINES_A_FILE,
                          text + after + strspn(text + after, "():0123456789 "));
    return pt_gl_fail(d, PATINA_ERROR_DEVICE, "shader %s: %s", s->files[0], *text ? text : "the driver gives no reason");
}

static int compile(struct pt_gl_device *d, const struct source *s, GLuint *program)
{
    const GladGLContext *gl = &d->gl;
    char log[LOG_SIZE] = "";
    GLint ok = 0, length = (GLint)s->length;
    const GLchar *text = s->text;
    GLuint shader = gl->CreateShader(GL_COMPUTE_SHADER);
    gl->ShaderSource(shader, 1, &text, &length);
    gl->CompileShader(shader);
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        gl->GetShaderInfoLog(shader, sizeof log, NULL, log);
        gl->DeleteShader(shader);
        int lost = pt_gl_check(d, "compiling a shader");
        return d->lost ? lost : fail_with_log(d, s, log);
    }
    GLuint p = gl->CreateProgram();
    gl->AttachShader(p, shader);
    gl->LinkProgram(p);
    gl->DetachShader(p, shader);
    gl->DeleteShader(shader);
    gl->GetProgramiv(p, GL_LINK_STATUS, &ok);
    if (!ok) {
        gl->GetProgramInfoLog(p, sizeof log, NULL, log);
        gl->DeleteProgram(p);
        int lost = pt_gl_check(d, "linking a shader");
        return d->lost ? lost : fail_with_log(d, s, log);
    }
    *program = p;
    return pt_gl_check(d, "compiling a shader");
}

// For build/check_spirv: writes the text of a program that the driver took to the folder that PATINA_SHADER_DUMP names, once for each different text.
static void dump(const struct source *s)
{
    const char *folder = getenv("PATINA_SHADER_DUMP");
    char name[MAX_NAME], path[4096];
    uint64_t sum = 0xCBF29CE484222325u; // FNV-1a
    if (!folder || !*folder)
        return;
    for (size_t i = 0; i < s->length; i++)
        sum = (sum ^ (unsigned char)s->text[i]) * 0x100000001B3u;
    snprintf(name, sizeof name, "%s", s->body ? s->body : s->files[0]);
    for (char *c = name; *c; c++)
        *c = *c == '/' || *c == '.' ? '_' : *c;
    const int length = snprintf(path, sizeof path, "%s/%s-%016llx.comp", folder, name, (unsigned long long)sum);
    FILE *file = length > 0 && (size_t)length < sizeof path ? pt_stream_open(path, "wb") : NULL;
    if (file) {
        fwrite(s->text, 1, s->length, file);
        fclose(file);
    }
}

// The numbers of its storage blocks and textures.
static const char *bindings_of(const char *name)
{
    const struct pt_embedded_shader *s = pt_shader_bindings;
    while (s->name && strcmp(s->name, name) != 0)
        s++;
    return s->name ? s->text : "";
}

int pt_gl_program(struct pt_gl_device *d, const char *name, const char *definitions, GLuint *program)
{
    return pt_gl_program_of_body(d, name, definitions, NULL, program);
}

int pt_gl_program_of_body(struct pt_gl_device *d, const char *name, const char *definitions, const char *body, GLuint *program)
{
    struct source s = {.body = body};
    char all[2048];
    snprintf(all, sizeof all, "%s%s%s", d->base.info.hardware ? "" : "#define PT_SOFTWARE 1\n", bindings_of(body ? body : name),
             definitions);
    int result = add_file(d, &s, name, all);
    if (result == PATINA_OK)
        result = compile(d, &s, program);
    if (result == PATINA_OK)
        dump(&s);
    free(s.text);
    return result;
}
