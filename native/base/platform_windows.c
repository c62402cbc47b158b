// SPDX-License-Identifier: GPL-3.0-or-later
// platform.h on Windows 10 and later, with its own C library (UCRT). What takes paths takes them wide; no call here depends on the
// process's code page.
#define WIN32_LEAN_AND_MEAN
#include "platform.h"
#include "guard.h"

#include <windows.h>
// windows.h goes first
#include <errno.h>
#include <fcntl.h>
#include <io.h>
#include <locale.h>
#include <process.h>
#include <psapi.h>
#include <shellapi.h>
#include <stdlib.h>
#include <string.h>

// ---- threads -----------------------------------------------------------------------------------------------------------

_Static_assert(sizeof(SRWLOCK) <= sizeof(struct pt_mutex), "room of a mutex");
_Static_assert(sizeof(CONDITION_VARIABLE) <= sizeof(struct pt_condition), "room of a condition");
_Static_assert(sizeof(HANDLE) <= sizeof(struct pt_thread), "room of a thread");

static SRWLOCK *lock_of(struct pt_mutex *mutex) { return (SRWLOCK *)(void *)mutex->room; }
static CONDITION_VARIABLE *condition_of(struct pt_condition *condition)
{
    return (CONDITION_VARIABLE *)(void *)condition->room;
}

void pt_mutex_init(struct pt_mutex *mutex) { InitializeSRWLock(lock_of(mutex)); }
void pt_mutex_destroy(struct pt_mutex *mutex) { (void)mutex; }
void pt_mutex_lock(struct pt_mutex *mutex) { AcquireSRWLockExclusive(lock_of(mutex)); }
void pt_mutex_unlock(struct pt_mutex *mutex) { ReleaseSRWLockExclusive(lock_of(mutex)); }

void pt_condition_init(struct pt_condition *condition) { InitializeConditionVariable(condition_of(condition)); }
void pt_condition_destroy(struct pt_condition *condition) { (void)condition; }
void pt_condition_wait(struct pt_condition *condition, struct pt_mutex *mutex)
{
    SleepConditionVariableSRW(condition_of(condition), lock_of(mutex), INFINITE, 0);
}
void pt_condition_wake_one(struct pt_condition *condition) { WakeConditionVariable(condition_of(condition)); }
void pt_condition_wake_all(struct pt_condition *condition) { WakeAllConditionVariable(condition_of(condition)); }

struct start {
    void (*main)(void *context);
    void *context;
};

static unsigned __stdcall thread_main(void *argument)
{
    struct start start = *(struct start *)argument;
    free(argument);
    start.main(start.context);
    return 0;
}

int pt_thread_start(struct pt_thread *thread, void (*main)(void *context), void *context, size_t stack)
{
    struct start *start = malloc(sizeof *start);
    if (!start)
        return ENOMEM;
    *start = (struct start){main, context};
    const HANDLE handle = (HANDLE)_beginthreadex(NULL, (unsigned)stack, thread_main, start, STACK_SIZE_PARAM_IS_A_RESERVATION,
                                                 NULL);
    if (!handle) {
        free(start);
        return errno;
    }
    memcpy(thread->room, &handle, sizeof handle);
    return 0;
}

void pt_thread_join(struct pt_thread *thread)
{
    HANDLE handle;
    memcpy(&handle, thread->room, sizeof handle);
    WaitForSingleObject(handle, INFINITE);
    CloseHandle(handle);
}

void pt_thread_yield(void) { SwitchToThread(); }

void pt_pause(uint32_t milliseconds) { Sleep(milliseconds); }

static void (*watcher)(void);

static BOOL WINAPI on_console(DWORD event) // on a thread that Windows makes for it
{
    if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT && event != CTRL_CLOSE_EVENT)
        return FALSE;
    watcher();
    return TRUE;
}

int pt_watch_interrupts(void (*interrupted)(void))
{
    watcher = interrupted;
    return SetConsoleCtrlHandler(on_console, TRUE) ? 0 : EINVAL;
}

// ---- errors ------------------------------------------------------------------------------------------------------------

// EBUSY: another program has the file open, or maps it.
static int error_of(DWORD error)
{
    switch (error) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_BAD_PATHNAME:
    case ERROR_BAD_NETPATH:
    case ERROR_BAD_NET_NAME:
    case ERROR_INVALID_DRIVE: return ENOENT;
    case ERROR_ACCESS_DENIED:
    case ERROR_WRITE_PROTECT: return EACCES;
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
    case ERROR_USER_MAPPED_FILE: return EBUSY;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL: return ENOSPC;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
    case ERROR_COMMITMENT_LIMIT: return ENOMEM;
    case ERROR_ALREADY_EXISTS:
    case ERROR_FILE_EXISTS: return EEXIST;
    case ERROR_INVALID_NAME:
    case ERROR_NO_UNICODE_TRANSLATION: return EINVAL;
    case ERROR_FILENAME_EXCED_RANGE: return ENAMETOOLONG;
    default: return EIO;
    }
}

static int last_error(void) { return error_of(GetLastError()); }

const char *pt_error_text(int error, char *buffer, size_t size)
{
    if (error == EBUSY)
        return "another program holds the file open";
    if (strerror_s(buffer, size, error))
        snprintf(buffer, size, "error %d", error);
    return buffer;
}

// ---- the machine -------------------------------------------------------------------------------------------------------

double pt_milliseconds(void)
{
    LARGE_INTEGER now, rate;
    QueryPerformanceCounter(&now);
    QueryPerformanceFrequency(&rate);
    return 1e3 * ((double)now.QuadPart / (double)rate.QuadPart);
}

uint32_t pt_core_count(void)
{
    DWORD_PTR own = 0, all = 0;
    if (GetProcessAffinityMask(GetCurrentProcess(), &own, &all) && own)
        return (uint32_t)__builtin_popcountll(own);
    const DWORD count = GetActiveProcessorCount(ALL_PROCESSOR_GROUPS); // spread over groups the mask is 0
    return count ? count : 1;
}

void pt_processor_name(char *text, size_t size)
{
    char name[256] = "";
    DWORD room = sizeof name - 1;
    const LSTATUS error = RegGetValueA(HKEY_LOCAL_MACHINE, "HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0",
                                       "ProcessorNameString", RRF_RT_REG_SZ, NULL, name, &room);
    const char *start = name + strspn(name, " ");
    snprintf(text, size, "%s", error || !*start ? "processor" : start);
}

uint64_t pt_peak_memory(void)
{
    PROCESS_MEMORY_COUNTERS counters = {.cb = sizeof counters};
    return K32GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters) ? counters.PeakWorkingSetSize : 0;
}

uint64_t pt_free_memory(void)
{
    MEMORYSTATUSEX about = {.dwLength = sizeof about};
    return GlobalMemoryStatusEx(&about) ? about.ullAvailPhys : 0;
}

uint64_t pt_file_memory(void) // all that the process holds: Windows does not tell files apart
{
    PROCESS_MEMORY_COUNTERS counters = {.cb = sizeof counters};
    return K32GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters) ? counters.WorkingSetSize : 0;
}

// ---- memory ------------------------------------------------------------------------------------------------------------

void *pt_pages_alloc(size_t size)
{
    return size > SIZE_MAX / 2 ? NULL : VirtualAlloc(NULL, size ? size : 1, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE);
}

void *pt_pages_reserve(size_t size)
{
    return size > SIZE_MAX / 2 ? NULL : VirtualAlloc(NULL, size ? size : 1, MEM_RESERVE, PAGE_READWRITE);
}

int pt_pages_need(void *pages, size_t size)
{
    return !size || VirtualAlloc(pages, size, MEM_COMMIT, PAGE_READWRITE) ? 0 : ENOMEM; // what is there already stays as it is
}

void pt_pages_forget(void *pages, size_t size)
{
    const uintptr_t page = 4096, first = ((uintptr_t)pages + page - 1) / page * page,
                    end = ((uintptr_t)pages + size) / page * page;
    if (end > first)
        VirtualFree((void *)first, end - first, MEM_DECOMMIT);
}

void pt_pages_free(void *pages, size_t size)
{
    MEMORY_BASIC_INFORMATION info;
    (void)size;
    if (!pages)
        return;
    pt_guard_remove(pages);
    if (VirtualQuery(pages, &info, sizeof info) && info.Type == MEM_MAPPED)
        UnmapViewOfFile(pages);
    else
        VirtualFree(pages, 0, MEM_RELEASE);
}

// Unlocking pages that nobody locked takes them out of the working set.
void pt_pages_return(void *pages, size_t size)
{
    if (size)
        VirtualUnlock(pages, size);
}

void pt_pages_expect(void *pages, size_t size)
{
    WIN32_MEMORY_RANGE_ENTRY range = {pages, size};
    if (size)
        PrefetchVirtualMemory(GetCurrentProcess(), 1, &range, 0);
}

// ---- paths -------------------------------------------------------------------------------------------------------------

// From so many letters on Windows wants to be told that a path is long: 260, less a name of 8.3 in a folder.
enum { LONG_PATH = 248 };

// An absolute path, with \\?\ before it where it is long: no limit but 32767 then. NULL: *error says why. The caller frees it.
static wchar_t *wide_path(const char *path, int *error)
{
    static const wchar_t far_mark[] = L"\\\\?\\UNC\\", mark[] = L"\\\\?\\";
    enum { MARK = sizeof far_mark / sizeof *far_mark };
    const int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, NULL, 0);
    wchar_t *wide = length > 0 ? malloc((size_t)length * sizeof *wide) : NULL, *full = NULL;
    *error = length > 0 ? ENOMEM : EINVAL;
    if (!wide)
        return NULL;
    MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, length);
    const DWORD room = *wide ? GetFullPathNameW(wide, 0, NULL, NULL) : 0;
    if (!room)
        *error = ENOENT;
    else
        full = malloc((MARK + (size_t)room) * sizeof *full);
    if (full && !GetFullPathNameW(wide, room, full + MARK, NULL)) {
        *error = last_error();
        free(full);
        full = NULL;
    }
    free(wide);
    if (!full)
        return NULL;
    wchar_t *start = full + MARK;
    if (wcslen(start) >= LONG_PATH && wcsncmp(start, L"\\\\?\\", 4) && wcsncmp(start, L"\\\\.\\", 4)) {
        const int share = !wcsncmp(start, L"\\\\", 2); // \\server\share becomes \\?\UNC\server\share
        const wchar_t *before = share ? far_mark : mark;
        start = start + (share ? 2 : 0) - wcslen(before);
        memcpy(start, before, wcslen(before) * sizeof *before);
    }
    memmove(full, start, (wcslen(start) + 1) * sizeof *start);
    return full;
}

static int is_device(const wchar_t *path) { return !wcsncmp(path, L"\\\\.\\", 4); } // NUL, COM1

// ---- files -------------------------------------------------------------------------------------------------------------

int pt_disk_open(const char *path, struct pt_disk *disk)
{
    int error;
    wchar_t *wide = wide_path(path, &error);
    if (!wide)
        return error;
    // others may write, rename and delete it meanwhile, as on other systems; FLAG_BACKUP_SEMANTICS: folders open
    const HANDLE handle = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                                      OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, NULL);
    error = handle == INVALID_HANDLE_VALUE ? last_error() : 0;
    free(wide);
    if (error)
        return error;
    BY_HANDLE_FILE_INFORMATION about = {0};
    disk->kind = PT_DISK_OTHER;
    if (GetFileType(handle) == FILE_TYPE_DISK) {
        if (!GetFileInformationByHandle(handle, &about)) {
            error = last_error();
            CloseHandle(handle);
            return error;
        }
        disk->kind = about.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY ? PT_DISK_FOLDER : PT_DISK_FILE;
    }
    disk->handle = (intptr_t)handle;
    disk->size = (uint64_t)about.nFileSizeHigh << 32 | about.nFileSizeLow;
    return 0;
}

void pt_disk_close(struct pt_disk *disk) { CloseHandle((HANDLE)disk->handle); }

int pt_disk_read(const struct pt_disk *disk, uint64_t offset, void *data, size_t size, size_t *got)
{
    for (*got = 0; *got < size;) {
        const size_t left = size - *got;
        const uint64_t at = offset + *got;
        OVERLAPPED from = {.Offset = (DWORD)at, .OffsetHigh = (DWORD)(at >> 32)};
        DWORD now = 0;
        if (!ReadFile((HANDLE)disk->handle, (char *)data + *got, (DWORD)(left < 1u << 30 ? left : 1u << 30), &now, &from)) {
            if (GetLastError() == ERROR_HANDLE_EOF)
                break;
            return last_error();
        }
        if (!now)
            break;
        *got += now;
    }
    return 0;
}

// ---- pages that cannot be read -------------------------------------------------------------------------------------------

// A view cannot be replaced in part.
static void widen(uintptr_t mapping, size_t mapping_size, uintptr_t *first, uintptr_t *end)
{
    *first = mapping;
    *end = mapping + mapping_size;
}

// It becomes reserved memory, whose pages are zeros when they are first read (on_fault). Threads that read it in between wait in their own
// handler.
static int replace(uintptr_t first, size_t size, int written)
{
    (void)written;
    return UnmapViewOfFile((void *)first) && VirtualAlloc((void *)first, size, MEM_RESERVE, PAGE_READWRITE) == (void *)first;
}

static const struct pt_guard_system guarding = {widen, replace};

static LONG CALLBACK on_fault(EXCEPTION_POINTERS *exception)
{
    const EXCEPTION_RECORD *record = exception->ExceptionRecord;
    if ((record->ExceptionCode != EXCEPTION_IN_PAGE_ERROR && record->ExceptionCode != EXCEPTION_ACCESS_VIOLATION) ||
        record->NumberParameters < 2)
        return EXCEPTION_CONTINUE_SEARCH;
    const void *address = (const void *)record->ExceptionInformation[1];
    const int writes = record->ExceptionInformation[0] == 1;
    if (record->ExceptionCode == EXCEPTION_ACCESS_VIOLATION && writes && !pt_pages_lost(address, 1))
        return EXCEPTION_CONTINUE_SEARCH; // a fault of the program's own
    return pt_guard_fault((uintptr_t)address, &guarding) &&
                   VirtualAlloc((void *)(uintptr_t)address, 1, MEM_COMMIT, PAGE_READWRITE)
               ? EXCEPTION_CONTINUE_EXECUTION
               : EXCEPTION_CONTINUE_SEARCH;
}

// The first of all handlers: what is not ours goes on to those of the host.
void pt_disk_watch(void)
{
    static atomic_int watched;
    if (!atomic_exchange(&watched, 1))
        AddVectoredExceptionHandler(1, on_fault);
}

int pt_disk_map(const struct pt_disk *disk, uint64_t offset, size_t size, enum pt_disk_use use, void **data)
{
    const int written = use == PT_DISK_SHARED;
    const HANDLE section = CreateFileMappingW((HANDLE)disk->handle, NULL, written ? PAGE_READWRITE : PAGE_READONLY, 0, 0, NULL);
    pt_disk_watch();
    *data = section
                ? MapViewOfFile(section, written ? FILE_MAP_WRITE : FILE_MAP_READ, (DWORD)(offset >> 32), (DWORD)offset, size)
                : NULL;
    int error = *data ? 0 : last_error();
    if (section)
        CloseHandle(section); // the view holds it
    if (!error && (error = pt_guard_add(*data, size, written))) {
        UnmapViewOfFile(*data);
        *data = NULL;
    }
    return error;
}

FILE *pt_stream_open(const char *path, const char *mode)
{
    wchar_t kind[8] = {0};
    size_t length = 0;
    for (; mode[length] && length < 4; length++)
        kind[length] = (wchar_t)mode[length];
    if (!strchr(mode, 'b'))
        kind[length++] = L'b'; // what is written is what the file holds
    kind[length] = L'N';       // programs that are started do not inherit it
    int error;
    wchar_t *wide = wide_path(path, &error);
    FILE *stream = wide ? _wfopen(wide, kind) : NULL;
    if (!wide)
        errno = error;
    free(wide);
    return stream;
}

int pt_stream_seek(FILE *stream, uint64_t offset) { return _fseeki64(stream, (int64_t)offset, SEEK_SET) ? errno : 0; }

int pt_stream_resize(FILE *stream, uint64_t size) { return fflush(stream) ? errno : _chsize_s(_fileno(stream), (int64_t)size); }

int pt_file_remove(const char *path)
{
    int error;
    wchar_t *wide = wide_path(path, &error);
    if (!wide)
        return error;
    error = DeleteFileW(wide) ? 0 : last_error();
    free(wide);
    return error;
}

// A name beside `path` that no other call has: path.PROCESS-NUMBER.ending.
static char *name_beside(const char *path, const char *ending)
{
    static atomic_uint number;
    const size_t size = strlen(path) + 48;
    char *name = malloc(size);
    if (name)
        snprintf(name, size, "%s.%lu-%u%s", path, (unsigned long)GetCurrentProcessId(), atomic_fetch_add(&number, 1), ending);
    return name;
}

static int lives(unsigned long process)
{
    const HANDLE handle = OpenProcess(SYNCHRONIZE, FALSE, process);
    const int alive = handle ? WaitForSingleObject(handle, 0) == WAIT_TIMEOUT : GetLastError() == ERROR_ACCESS_DENIED;
    if (handle)
        CloseHandle(handle);
    return alive;
}

// What processes that live no longer left beside the file.
static void remove_left(const wchar_t *wide)
{
    const size_t length = wcslen(wide);
    wchar_t *all = malloc((length + 1 + MAX_PATH + 16) * sizeof *all);
    size_t folder = length;
    while (folder && wide[folder - 1] != L'\\' && wide[folder - 1] != L'/')
        folder--;
    WIN32_FIND_DATAW found;
    if (!all)
        return;
    memcpy(all, wide, length * sizeof *all);
    memcpy(all + length, L".*.part*", 9 * sizeof *all); // of pt_whole_steps too
    const HANDLE search = FindFirstFileW(all, &found);
    if (search != INVALID_HANDLE_VALUE) {
        do {
            const size_t own = length - folder;
            wchar_t *end;
            if (wcslen(found.cFileName) <= own + 1)
                continue;
            const unsigned long process = wcstoul(found.cFileName + own + 1, &end, 10);
            if (*end != L'-' || lives(process))
                continue;
            memcpy(all + folder, found.cFileName, (wcslen(found.cFileName) + 1) * sizeof *all);
            DeleteFileW(all);
        } while (FindNextFileW(search, &found));
        FindClose(search);
    }
    free(all);
}

int pt_disk_spill(const char *path, struct pt_disk *disk)
{
    int error = ENOMEM;
    char *name = name_beside(path, ".spill");
    wchar_t *wide = name ? wide_path(name, &error) : NULL;
    free(name);
    if (!wide)
        return error;
    const HANDLE handle = CreateFileW(wide, GENERIC_READ | GENERIC_WRITE, 0, NULL, CREATE_NEW,
                                      FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, NULL);
    error = handle == INVALID_HANDLE_VALUE ? last_error() : 0;
    free(wide);
    *disk = (struct pt_disk){.handle = (intptr_t)handle, .kind = PT_DISK_FILE};
    return error;
}

int pt_disk_reserve(struct pt_disk *disk, uint64_t size)
{
    FILE_END_OF_FILE_INFO end = {.EndOfFile = {.QuadPart = (LONGLONG)size}};
    if (!SetFileInformationByHandle((HANDLE)disk->handle, FileEndOfFileInfo, &end, sizeof end))
        return last_error();
    disk->size = size;
    return 0;
}

int pt_disk_write(struct pt_disk *disk, uint64_t offset, const void *data, size_t size)
{
    for (size_t done = 0; done < size;) {
        const size_t left = size - done;
        const uint64_t at = offset + done;
        OVERLAPPED to = {.Offset = (DWORD)at, .OffsetHigh = (DWORD)(at >> 32)};
        DWORD now = 0;
        if (!WriteFile((HANDLE)disk->handle, (const char *)data + done, (DWORD)(left < 1u << 30 ? left : 1u << 30), &now, &to))
            return last_error();
        if (!now)
            return ENOSPC;
        done += now;
    }
    disk->size = disk->size > offset + size ? disk->size : offset + size;
    return 0;
}

int pt_disk_room(const char *path, uint64_t *bytes)
{
    const size_t length = strlen(path);
    size_t folder = length;
    while (folder && path[folder - 1] != '\\' && path[folder - 1] != '/')
        folder--;
    char *name = malloc(folder + 2);
    if (!name)
        return ENOMEM;
    memcpy(name, folder ? path : ".", folder ? folder : 1);
    name[folder ? folder : 1] = 0;
    ULARGE_INTEGER free_bytes = {0};
    int error;
    wchar_t *wide = wide_path(name, &error);
    free(name);
    if (!wide)
        return error;
    error = GetDiskFreeSpaceExW(wide, &free_bytes, NULL, NULL) ? 0 : last_error();
    free(wide);
    *bytes = free_bytes.QuadPart;
    return error;
}

int pt_whole_begin(const char *path, struct pt_whole *whole)
{
    int error;
    *whole = (struct pt_whole){0};
    wchar_t *wide = wide_path(path, &error);
    if (!wide)
        return error;
    const DWORD there = GetFileAttributesW(wide);
    error = is_device(wide) ? EINVAL : there != INVALID_FILE_ATTRIBUTES && there & FILE_ATTRIBUTE_DIRECTORY ? EISDIR : 0;
    if (!error)
        remove_left(wide);
    free(wide);
    if (error) // never in the place of a folder or a device
        return error;
    whole->path = _strdup(path);
    whole->beside = name_beside(path, ".part");
    whole->stream = whole->path && whole->beside ? pt_stream_open(whole->beside, "wb") : NULL;
    if (whole->stream) {
        errno = 0; // of what is written from now on
        return 0;
    }
    error = whole->path && whole->beside ? errno : ENOMEM;
    free(whole->path);
    free(whole->beside);
    return error;
}

// What another program has open, or maps, cannot be replaced. What looks for viruses holds new files for a moment: asked again.
int pt_file_replace(const char *path, const char *by)
{
    enum { TRIES = 6, PAUSE = 15 }; // milliseconds
    int error = 0;
    wchar_t *from = wide_path(by, &error), *to = from ? wide_path(path, &error) : NULL;
    for (int i = 0; to && i < TRIES; i++) {
        if (i)
            Sleep(PAUSE);
        const int moved = MoveFileExW(from, to, MOVEFILE_REPLACE_EXISTING) != 0;
        const DWORD why = moved ? 0 : GetLastError(), there = moved ? 0 : GetFileAttributesW(to);
        error = moved ? 0 : error_of(why);
        // a file that is held answers so too; one that is read-only says it itself
        if (why == ERROR_ACCESS_DENIED && there != INVALID_FILE_ATTRIBUTES && !(there & FILE_ATTRIBUTE_READONLY))
            error = EBUSY;
        if (error != EBUSY)
            break;
    }
    free(to);
    free(from);
    return error;
}

int pt_whole_end(struct pt_whole *whole, int good)
{
    int error = good ? 0 : errno ? errno : EIO;
    if (fclose(whole->stream) && !error)
        error = errno;
    if (!error)
        error = pt_file_replace(whole->path, whole->beside);
    if (error)
        pt_file_remove(whole->beside);
    free(whole->path);
    free(whole->beside);
    return error;
}

// ---- libraries ---------------------------------------------------------------------------------------------------------

void *pt_library_open(const char *name)
{
    wchar_t wide[1024];
    HMODULE pinned = NULL;
    if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, name, -1, wide, 1024) <= 0)
        return NULL;
    // of Windows' own folder, or by a whole path: never one that lies in the folder that the program was started in
    const HMODULE library = LoadLibraryExW(wide, NULL,
                                           strpbrk(name, "/\\") ? LOAD_WITH_ALTERED_SEARCH_PATH : LOAD_LIBRARY_SEARCH_SYSTEM32);
    if (library)
        GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_PIN | GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS, (LPCWSTR)(void *)library,
                           &pinned);
    return library;
}

void *pt_library_find(void *library, const char *function)
{
    const FARPROC found = GetProcAddress(library, function);
    void *address;
    memcpy(&address, &found, sizeof address);
    return address;
}

void pt_library_close(void *library)
{
    if (library)
        FreeLibrary(library);
}

// ---- numbers and programs ----------------------------------------------------------------------------------------------

static struct pt_once c_locale_made;
static _locale_t c_locale;

static void make_c_locale(void) { c_locale = _create_locale(LC_ALL, "C"); }

double pt_decimal(const char *text)
{
    pt_once(&c_locale_made, make_c_locale);
    return _strtod_l(text, NULL, c_locale);
}

int pt_program_begin(int *count, char ***arguments)
{
    int wide_count = 0;
    wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), &wide_count);
    char **texts = wide ? calloc((size_t)wide_count + 1, sizeof *texts) : NULL;
    for (int i = 0; texts && i < wide_count; i++) { // kept as long as the program runs
        const int size = WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, NULL, 0, NULL, NULL);
        texts[i] = malloc((size_t)size + 1);
        if (!texts[i])
            return ENOMEM;
        WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, texts[i], size, NULL, NULL);
    }
    LocalFree(wide);
    if (!texts)
        return ENOMEM;
    *count = wide_count;
    *arguments = texts;
    SetConsoleOutputCP(CP_UTF8);
    _setmode(_fileno(stdout), _O_BINARY); // the same bytes as on other systems
    _setmode(_fileno(stderr), _O_BINARY);
    return 0;
}
