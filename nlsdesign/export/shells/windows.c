/* Linked into Windows libraries in place of the start-up code of a C runtime, which does nothing for plain C
   without static constructors and would take minutes to compile. The functions of C come from ucrtbase.dll. */
#include <stdarg.h>
#include <stddef.h>

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved);
int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library, (void)reason, (void)reserved;
    return 1;
}

int __cdecl __stdio_common_vsprintf(unsigned long long options, char *text, size_t size, const char *format,
                                    void *locale, va_list arguments);
int vsnprintf(char *text, size_t size, const char *format, va_list arguments);
int vsnprintf(char *text, size_t size, const char *format, va_list arguments)
{
    return __stdio_common_vsprintf(2, text, size, format, NULL, arguments); /* 2: as the C standard has it */
}
